"""Foreign text made safe to print."""

import re

_UNPRINTABLE = re.compile(
    "["
    "\x00-\x08\x0b-\x1f"  # C0 without tab and newline
    "\x7f-\x9f"  # DEL and C1
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # direction of writing
    "\u2028\u2029"  # line and paragraph separator
    "\ud800-\udfff"  # halves of surrogate pairs: no encoding can write them
    "]"
)


def printable(text: str) -> str:
    """The text with each control character replaced by its escape, such as `\\x1b` or `\\u202e`.

    A terminal obeys control characters: names and texts from files and from other processes
    could move the cursor, clear the screen or hide what stands there. Newline and tab are kept.
    The result contains nothing to escape, so a second call changes nothing.
    """
    return _UNPRINTABLE.sub(_escape, text)


def _escape(found: re.Match[str]) -> str:
    code = ord(found.group())
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"
