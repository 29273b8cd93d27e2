"""The four themes: every colour of the palette is readable on every ground it stands on."""

from __future__ import annotations

import pytest
from rich.color import ColorSystem
from rich.style import Style

from stack.errors import InputError
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.drawing import palette
from tui.drawing.palette import css
from tui.terminal.themes import (
    AREAS,
    DOTS,
    PICTURE,
    SETTING,
    THEMES,
    WORDS,
    area_without_colours,
    chosen_theme,
    codes_of,
    light,
    oklch,
    packed_of,
)

GROUNDS = (palette.BACKDROP, palette.PANEL, palette.FREE, palette.ACTIVE_ROW)
WRITTEN = ("TEXT", "DIM", "GOOD", "BAD", "BUSY", "WARN", "PERSON", "PATH", "LOCAL_PLAN", "SCAN",
           "PARTICLE", "GOAL", "DETECTION", "RIVAL")  # fmt: skip
TRUE = ColorSystem.TRUECOLOR


def contrast(one: int, other: int) -> float:
    """WCAG 2.2, relative luminance and contrast ratio."""

    def luminance(packed: int) -> float:
        parts = [(packed >> shift & 255) / 255 for shift in (16, 8, 0)]
        r, g, b = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
        return 0.2126 * r + 0.7152 * g + 0.0722 * b

    bright, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_all_that_is_read_has_the_contrast_of_wcag_aa(theme):
    """4.5 for text (WCAG 2.2, success criterion 1.4.3)."""
    shown = light if theme == "light" else int
    for name in WRITTEN:
        for ground in GROUNDS:
            found = contrast(shown(getattr(palette, name)), shown(ground))
            assert found >= 4.5, (name, f"{ground:06x}", found)


def test_light_keeps_hues_and_makes_light_grounds():
    for name in ("GOOD", "BAD", "BUSY", "WARN", "PARTICLE"):
        before, after = oklch(getattr(palette, name)), oklch(light(getattr(palette, name)))
        assert abs((before[2] - after[2] + 180) % 360 - 180) < 8, name
    assert all(oklch(light(ground))[0] > 0.85 for ground in GROUNDS)


def test_the_conversion_is_that_of_its_author():
    """Pure red has lightness 0.628, chroma 0.258, hue 29.2: Ottosson 2020; and back."""
    assert oklch(0xFF0000) == pytest.approx((0.628, 0.258, 29.23), abs=1e-2)
    assert packed_of(*oklch(0x3DDC97)) == 0x3DDC97


@pytest.mark.parametrize(
    ("name", "number"),
    [("GOOD", 92), ("BAD", 91), ("WARN", 93), ("BUSY", 94), ("LOCAL_PLAN", 96), ("PARTICLE", 95),
     ("TEXT", 37), ("FAINT", 90), ("ROBOT_TEXT", 97)],
)  # fmt: skip
def test_sixteen_colours_are_chosen_by_hue(name, number):
    style = Style(color=css(getattr(palette, name)), bgcolor=css(palette.BACKDROP))
    assert codes_of(style, TRUE, "16") == ("", str(number), "40")
    assert codes_of(style, ColorSystem.STANDARD, "dark") == ("", str(number), "40")


def test_words_are_never_written_in_the_colour_of_their_ground():
    colours = [value for value in vars(palette).values() if type(value) is int]
    for front in colours:
        for back in colours:
            _, text, ground = codes_of(Style(color=css(front), bgcolor=css(back)), TRUE, "16")
            assert int(text) + 10 != int(ground), (f"{front:06x}", f"{back:06x}")


def test_without_colours_nothing_but_attributes_is_written():
    badge = Style(color=css(palette.PANEL), bgcolor=css(palette.BUSY), bold=True)
    assert codes_of(badge, TRUE, "none") == ("1;7", "", "")
    quiet = Style(color=css(palette.IDLE), bgcolor=css(palette.BACKDROP))
    for kind in (WORDS, DOTS, AREAS):
        assert codes_of(quiet, TRUE, "none", kind) == ("2", "", "")


@pytest.mark.parametrize(
    ("upper", "lower", "shown"),
    [(palette.FREE, palette.COST_LOW, " "), (palette.WALL, palette.FREE, "▀"),
     (palette.COST_HIGH, palette.WALL, "▄"), (0x808080, 0x808080, "▒"), (0xFFFFFF, 0xFFFFFF, "█")],
)  # fmt: skip
def test_without_colours_areas_are_shades(upper, lower, shown):
    assert area_without_colours(Style(color=css(upper), bgcolor=css(lower))) == shown


def test_a_photo_is_no_negative_in_a_light_theme():
    photo = Style(color="#101010", bgcolor="#f0f0f0", meta={PICTURE: True})
    assert codes_of(photo, TRUE, "light", AREAS) == codes_of(photo, TRUE, "dark", AREAS)


@pytest.mark.parametrize(
    ("setting", "no_color", "theme"),
    [("", "", ""), ("", "1", "none"), ("light", "1", "light"), ("none", "", "none")],
)
def test_the_environment_chooses(monkeypatch, setting, no_color, theme):
    monkeypatch.setenv(SETTING, setting)
    monkeypatch.setenv("NO_COLOR", no_color)
    assert chosen_theme() == theme


def test_a_theme_that_does_not_exist_is_refused(monkeypatch):
    monkeypatch.setenv(SETTING, "solarized")
    with pytest.raises(InputError, match="TREEPILOT_THEME=solarized: expected dark, light"):
        chosen_theme()


async def test_a_key_goes_through_all_of_them():
    app = Dashboard(SampleSource(), live=False)
    async with app.run_test(size=(80, 24)) as pilot:
        app.show_theme("dark")
        pictures = {}
        for theme in THEMES:
            assert app.shown_theme == theme
            pictures[theme] = app.export_screenshot()
            await pilot.press("T")
        assert app.shown_theme == "dark"
    assert len(set(pictures.values())) == 4
    assert css(palette.GOOD) in pictures["dark"] and css(light(palette.GOOD)) in pictures["light"]
