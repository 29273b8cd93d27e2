"""The colours: dark navy, muted costs, one accent per meaning. Packed as 0xRRGGBB."""

from __future__ import annotations

FREE, UNKNOWN, WALL, WALL_DIM = 0x0D1522, 0x070A10, 0x93A5C1, 0x3A475C
COST_LOW, COST_HIGH = 0x101828, 0x52234A
SENSED = 0xB45A6B
PATH, LOCAL_PLAN, TRAIL = 0x3DDC97, 0x7DE3F4, 0x1F6F56
SCAN, PARTICLE, PERSON = 0xFF7B6B, 0xB39DFF, 0xFFB454
ROBOT, ROBOT_TEXT, GOAL, MARKER, PLACE = 0x4C8DFF, 0xFFFFFF, 0xFFC64D, 0xE6EDF7, 0x6C7F9C
TEXT, DIM, FAINT = 0xC9D6EA, 0x7B8CA8, 0x3B4961
GOOD, BAD, BUSY, WARN = 0x3DDC97, 0xFF6B6B, 0x5AA2FF, 0xFFC64D

STATUS_COLOUR = {"success": GOOD, "failure": BAD, "running": BUSY, "idle": FAINT}
STATUS_GLYPH = {"success": "✔", "failure": "✘", "running": "▶", "idle": "·"}

STATE_COLOUR = {
    "starting": BUSY, "running": BUSY, "paused": WARN, "emergency stop": BAD, "success": GOOD,
    "failure": BAD, "aborted": WARN, "interrupted": WARN, "error": BAD,
}  # fmt: skip


def css(colour: int) -> str:
    """A packed colour as `#rrggbb`."""
    return f"#{colour:06x}"


def blend(low: int, high: int, share: float) -> int:
    """The colour a share of the way from low to high."""
    mixed = 0
    for shift in (16, 8, 0):
        a, b = (low >> shift) & 255, (high >> shift) & 255
        mixed |= round(a + (b - a) * share) << shift
    return mixed
