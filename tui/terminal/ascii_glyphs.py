"""ASCII characters for terminals that show no others."""

from __future__ import annotations

import os
import sys
import unicodedata
from functools import lru_cache

WITHOUT_UNICODE = frozenset({"linux", "vt100", "vt102", "vt220", "vt320", "ansi", "cons25"})
"""Values of TERM whose terminals have no font for braille and blocks, or do not decode UTF-8."""

GLYPHS = {
    **dict.fromkeys("─━═╌╴╶", "-"), **dict.fromkeys("│┃║▌▐┊", "|"),
    **dict.fromkeys("┌┐└┘├┤┬┴┼╭╮╯╰", "+"), **dict.fromkeys("▘▝▖▗▚▞", "+"),
    **dict.fromkeys("▛▜▙▟█▄▊▉▇▆▅", "#"), **dict.fromkeys("▁▂▃▔▎▏▍", " "),
    "▀": " ", "░": ".", "▒": ":", "▓": "#",
    "→": ">", "←": "<", "↑": "^", "↓": "v", "↗": "/", "↖": "\\", "↙": "/", "↘": "\\",
    "✔": "+", "✘": "x", "▶": ">", "◆": "*", "◇": "?", "·": ".", "•": ".", "●": "o", "○": "o",
    "◦": "o", "⚑": "P", "▪": "#", "■": "#", "‖": "=", "⊘": "/", "◌": "o", "▲": "!", "⚙": "*",
    "…": "~", "×": "x", "±": "~", "θ": "t", "°": "'", "⇉": ">", "⁇": "?", "∥": "|", "↻": "@",
    "▣": "#", "⑂": "Y", "∅": "0", "⊣": "]", "¬": "!", "⊢": "[", "◔": "T", "↯": "!",
    "∀": "A", "↺": "@", "✚": "+", "◷": "T", "⟳": "@", "⊳": ">", "⊚": "@", "µ": "u", "½": "h",
}  # fmt: skip

MANY_DOTS = 4
"""Braille dots from which a cell is drawn as `:` instead of `.`"""


def needs_ascii() -> bool:
    """Whether the terminal of this process shows ASCII characters only.

    It does if the encoding of the output is not UTF-8 (the locale, or PYTHONIOENCODING), or TERM
    names a terminal without a Unicode font. Python takes the C locale for UTF-8.
    """
    stream = sys.__stderr__  # Textual draws on standard error
    encoding = (stream.encoding if stream is not None else "") or "ascii"
    utf8 = encoding.lower().replace("-", "").replace("_", "") == "utf8"
    return not utf8 or os.environ.get("TERM", "") in WITHOUT_UNICODE


@lru_cache(maxsize=4096)
def to_ascii(character: str) -> str:
    """Return one ASCII character for any character."""
    if character.isascii():
        return character
    if character in GLYPHS:
        return GLYPHS[character]
    if 0x2800 <= ord(character) < 0x2900:
        dots = (ord(character) - 0x2800).bit_count()
        return " " if not dots else ":" if dots >= MANY_DOTS else "."
    plain = unicodedata.normalize("NFKD", character)[0]
    return plain if plain.isascii() and plain.isprintable() else "?"
