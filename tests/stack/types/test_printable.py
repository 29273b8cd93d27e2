"""Control characters in text that is printed."""

import pytest

from stack.types.printable import printable


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("\x1b[2Jcleared", "\\x1b[2Jcleared"),  # escape sequence: clear the screen
        ("bell\x07 back\x08 return\r nul\0", "bell\\x07 back\\x08 return\\x0d nul\\x00"),
        ("\x7f\x9b31m", "\\x7f\\x9b31m"),  # DEL, and CSI as one character of C1
        ("a\u202eb\u2066c\u200fd\u061c", "a\\u202eb\\u2066c\\u200fd\\u061c"),  # bidi controls
        ("a\u2028b\u2029", "a\\u2028b\\u2029"),
        ("a\ud800b", "a\\ud800b"),
    ],
)
def test_control_characters_are_escaped(text: str, expected: str) -> None:
    assert printable(text) == expected
    assert printable(printable(text)) == expected


def test_ordinary_text_is_unchanged() -> None:
    text = "Küche, 東京, кухня, مطبخ, 👩‍🔧, 90°\n\tsecond line"
    assert printable(text) == text


def test_every_result_can_be_written_and_has_no_control_character() -> None:
    everything = "".join(map(chr, range(0x11000)))
    result = printable(everything)
    result.encode()
    controls = [c for c in result if (ord(c) < 0x20 or 0x7F <= ord(c) < 0xA0) and c not in "\n\t"]
    assert controls == []
