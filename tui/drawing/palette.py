"""Colours: dark navy, muted costs, one accent per meaning. Packed as 0xRRGGBB."""

from __future__ import annotations

from stack.types import HealthThresholds

BACKDROP, PANEL = 0x070A10, 0x0B111C
ACTIVE_ROW, CHOSEN_ROW = 0x101F37, 0x24395C
FREE, UNKNOWN = 0x0D1522, BACKDROP
WALL, WALL_DIM, WALL_SEEN = 0x8798B4, 0x3A475C, 0xBF929C
COST_LOW, COST_HIGH = 0x111827, 0x4A2144
SENSED = 0xB45A6B
PATH, LOCAL_PLAN, TRAIL = 0x3DDC97, 0x7DE3F4, 0x1F6F56
SCAN, PARTICLE, PERSON = 0xFF7B6B, 0xB39DFF, 0xFFB454
DETECTION = 0x7CE38B
BEAM_SHORT, BEAM_LONG, RIVAL, DEPTH = 0xFFD24D, 0x4DE1FF, 0xFF6BD6, 0xC8E64C
ROBOT, ROBOT_TEXT, GOAL, MARKER, PLACE = 0x4C8DFF, 0xFFFFFF, 0xFFC64D, 0xE6EDF7, 0x6C7F9C
TEXT, DIM, IDLE, FAINT = 0xC9D6EA, 0x7B8CA8, 0x64738E, 0x3B4961
GOOD, BAD, BUSY, WARN = 0x3DDC97, 0xFF6B6B, 0x5AA2FF, 0xFFC64D

FAILED_MESSAGE = 0xC98A92

STATUS_COLOUR = {"success": GOOD, "failure": BAD, "running": BUSY, "idle": FAINT}

TONES = {"good": GOOD, "bad": BAD, "warn": WARN, "busy": BUSY}
"""Colour of a header or a notice by its tone."""


def css(colour: int) -> str:
    """Return a packed colour as `#rrggbb`."""
    return f"#{colour:06x}"


def health_colour(health: float, thresholds: HealthThresholds) -> int:
    """Return the colour of a localisation health."""
    return GOOD if health >= thresholds.good else WARN if health >= thresholds.lost else BAD


def charge_colour(charge: float) -> int:
    """Return the colour of the charge of a battery, in [0, 1]."""
    return GOOD if charge > 0.4 else WARN if charge > 0.2 else BAD


def blend(low: int, high: int, share: float) -> int:
    """Return the colour at a fraction between low and high."""
    mixed = 0
    for shift in (16, 8, 0):
        a, b = (low >> shift) & 255, (high >> shift) & 255
        mixed |= round(a + (b - a) * share) << shift
    return mixed
