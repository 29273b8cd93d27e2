"""Themes: how the colours of the dashboard are written to a terminal.

The dashboard is drawn in the colours of `tui.drawing.palette`, on a dark ground. A theme turns the
colours of a cell into SGR parameters:

* dark: the colours as they are;
* light: lightness reversed, hues kept;
* 16: the 16 colours of the terminal, by hue and lightness;
* none: no colours; bold, dim and reverse video instead, and shades instead of coloured areas.

Lightness, chroma and hue are those of OKLCH (Björn Ottosson, "A perceptual color space for image
processing", 2020): lightness and chroma in [0, 1], hue in degrees.
"""

from __future__ import annotations

import os
from functools import lru_cache
from math import atan2, cos, degrees, hypot, radians, sin

from rich.color import Color, ColorSystem
from rich.color_triplet import ColorTriplet
from rich.style import Style

from stack.errors import InputError

THEMES = ("dark", "light", "16", "none")
SETTING = "TREEPILOT_THEME"
"""Environment variable that chooses a theme."""

Codes = tuple[str, str, str]
"""SGR parameters of a cell: attributes, foreground, background; empty: the terminal's default."""

ATTRIBUTES = ("bold", "dim", "italic", "underline", "blink", "blink2", "reverse", "conceal",
              "strike")  # fmt: skip
"""Attributes of Rich's styles whose SGR parameters are 1, 2, 3…"""

BOLD, DIM, REVERSE = "1", "2", "7"

WORDS, DOTS, AREAS = "words", "dots", "areas"
"""Kinds of characters."""

PICTURE = "picture"
"""Key of the meta data of a style whose colours are those of a photo: no theme reverses them."""

DARK_GROUND = 0.27
"""Lightness below which a background of the dashboard is a shade of black."""

VIVID_TEXT, VIVID_GROUND = 0.08, 0.11
"""Chroma from which text and backgrounds have a hue with 16 colours; others are grey."""

DARK_GROUNDS = frozenset({"40", "41", "44", "45", "100"})
"""Backgrounds of the 16 colours on which white text is more legible than black."""

HUES = ((65.0, 1), (125.0, 3), (175.0, 2), (230.0, 6), (285.0, 4), (345.0, 5), (360.0, 1))
"""Upper end of a range of hues, degrees, and the number of its ANSI colour."""

SHADES = ((0.36, " "), (0.5, "░"), (0.65, "▒"), (0.8, "▓"), (2.0, "█"))
"""End of a range of lightness of an area, and the character for it without colours."""

EDGE = 0.3
"""Difference in lightness of two areas from which only the lighter one is drawn."""


def chosen_theme() -> str:
    """The theme of the environment: TREEPILOT_THEME, else none with NO_COLOR, else empty.

    Raises:
        InputError: TREEPILOT_THEME is no theme.
    """
    wanted = os.environ.get(SETTING, "")
    if wanted and wanted not in THEMES:
        raise InputError(f"{SETTING}={wanted}: expected {', '.join(THEMES[:-1])} or {THEMES[-1]}")
    return wanted or ("none" if os.environ.get("NO_COLOR") else "")


def usual_theme(system: ColorSystem) -> str:
    """The theme for a terminal when none is chosen."""
    return "16" if system is ColorSystem.STANDARD else "dark"


@lru_cache(maxsize=16384)
def codes_of(style: Style, system: ColorSystem, theme: str, kind: str = WORDS) -> Codes:
    """Return the SGR parameters of a style.

    Args:
        style: in the colours of the dashboard.
        system: colours that the terminal has; with 16, dark and light are theme 16.
        theme: one of THEMES.
        kind: of the characters: WORDS, DOTS (braille), or AREAS (blocks).
    """
    attributes = [str(n) for n, name in enumerate(ATTRIBUTES, 1) if getattr(style, name)]
    front, back = _packed(style.color), _packed(style.bgcolor)
    if theme == "none":
        if kind == WORDS and back is not None and lightness(back) >= DARK_GROUND:
            attributes.append(REVERSE)
        elif front is not None and lightness(front) < 0.6 and BOLD not in attributes:
            attributes.append(DIM)
        return ";".join(attributes), "", ""
    if theme == "16" or system is ColorSystem.STANDARD:
        return ";".join(attributes), *_sixteen(front, back, kind)
    if theme == "light" and not (style._meta and PICTURE in style.meta):
        front = None if front is None else light(front)
        back = None if back is None else light(back)
    return ";".join(attributes), _codes(front, system, True), _codes(back, system, False)


def _sixteen(front: int | None, back: int | None, kind: str) -> tuple[str, str]:
    """Parameters of foreground and background, with 16 colours."""
    ground = "40" if back is None else ansi_ground(back)
    if front is None:
        return "", ground
    if kind == AREAS:
        return str(int(ansi_ground(front)) - 10), ground
    text = ansi_text(front)
    if kind == WORDS and (ground != "40" or text == "30"):
        text = "97" if ground in DARK_GROUNDS else "30"
    return text, ground


@lru_cache(maxsize=8192)
def area_without_colours(style: Style) -> str:
    """The character for two areas above each other, whose colours are not written."""
    upper, lower = (
        0.0 if one is None else lightness(one)
        for one in map(_packed, (style.color, style.bgcolor))
    )  # fmt: skip
    if abs(upper - lower) > EDGE:
        return "▀" if upper > lower else "▄"
    return next(shade for end, shade in SHADES if (upper + lower) / 2.0 < end)


@lru_cache(maxsize=4096)
def light(packed: int) -> int:
    """Return a colour for a light ground: dark greys become light ones, accents medium dark."""
    lightness, chroma, hue = oklch(packed)
    if lightness < 0.45:
        chroma *= 0.6  # what is a shade of black would be a colour among the light ones
    grey = min(1.0, max(0.1, 1.15 - 1.1 * lightness))
    accent = min(1.0, chroma / 0.12) * min(1.0, max(0.0, (lightness - 0.45) / 0.15))
    return packed_of(grey + (0.46 - grey) * accent, chroma, hue)


@lru_cache(maxsize=4096)
def ansi_text(packed: int) -> str:
    """Return the SGR parameter of a text of a colour, with 16 colours."""
    lightness, chroma, hue = oklch(packed)
    if lightness < DARK_GROUND:
        return "30"
    if chroma >= VIVID_TEXT:
        return str((90 if lightness > 0.6 else 30) + _ansi(hue))
    return "90" if lightness < 0.6 else "37" if lightness < 0.9 else "97"


@lru_cache(maxsize=4096)
def ansi_ground(packed: int) -> str:
    """Return the SGR parameter of a background of a colour, with 16 colours."""
    lightness, chroma, hue = oklch(packed)
    if lightness < DARK_GROUND:
        return "40"
    if chroma >= VIVID_GROUND:
        return str((100 if lightness > 0.6 else 40) + _ansi(hue))
    return "100" if lightness < 0.5 else "47" if lightness < 0.9 else "107"


def _ansi(hue: float) -> int:
    return next(number for end, number in HUES if hue < end)


def lightness(packed: int) -> float:
    """Return the lightness of a colour."""
    return oklch(packed)[0]


@lru_cache(maxsize=4096)
def oklch(packed: int) -> tuple[float, float, float]:
    """Return lightness, chroma and hue of a colour 0xRRGGBB."""
    r, g, b = (_linear(((packed >> shift) & 255) / 255.0) for shift in (16, 8, 0))
    l_ = (0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b) ** (1 / 3)
    m_ = (0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b) ** (1 / 3)
    s_ = (0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b) ** (1 / 3)
    a = 1.9779984951 * l_ - 2.4285922050 * m_ + 0.4505937099 * s_
    b = 0.0259040371 * l_ + 0.7827717662 * m_ - 0.8086757660 * s_
    found = 0.2104542553 * l_ + 0.7936177850 * m_ - 0.0040720468 * s_
    return found, hypot(a, b), degrees(atan2(b, a)) % 360.0


def packed_of(lightness: float, chroma: float, hue: float) -> int:
    """Return the colour 0xRRGGBB; with less chroma if a screen cannot show it."""
    while True:
        a, b = chroma * cos(radians(hue)), chroma * sin(radians(hue))
        l_ = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
        m_ = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
        s_ = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3
        parts = (
            4.0767416621 * l_ - 3.3077115913 * m_ + 0.2309699292 * s_,
            -1.2684380046 * l_ + 2.6097574011 * m_ - 0.3413193965 * s_,
            -0.0041960863 * l_ - 0.7034186147 * m_ + 1.7076147010 * s_,
        )
        if chroma < 0.001 or all(-0.001 <= part <= 1.001 for part in parts):
            break
        chroma *= 0.95
    red, green, blue = (round(255 * _encoded(min(1.0, max(0.0, part)))) for part in parts)
    return red << 16 | green << 8 | blue


def _linear(value: float) -> float:
    """The intensity of a coded value of sRGB, both in [0, 1]."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def _encoded(value: float) -> float:
    """The coded value of sRGB of an intensity, both in [0, 1]."""
    return value * 12.92 if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


def _packed(colour: Color | None) -> int | None:
    """The colour 0xRRGGBB; None for the terminal's default."""
    if colour is None or colour.is_default:
        return None
    red, green, blue = colour.get_truecolor()
    return red << 16 | green << 8 | blue


def _codes(packed: int | None, system: ColorSystem, foreground: bool) -> str:
    if packed is None:
        return ""
    triplet = ColorTriplet(packed >> 16, packed >> 8 & 255, packed & 255)
    colour = Color.from_triplet(triplet).downgrade(system)
    return ";".join(colour.get_ansi_codes(foreground))
