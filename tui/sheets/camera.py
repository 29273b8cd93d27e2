"""Camera: the newest picture in half blocks, with what was detected in it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.strip import Strip

from stack.telemetry.records import Snapshot
from stack.types import Detection, Image
from tui.drawing import palette
from tui.drawing.canvas import HALF_BLOCK
from tui.drawing.strips import Lines, ink, one_line, paper, to_strips
from tui.sheets.sheet import Sheet, Shown
from tui.terminal.themes import PICTURE

SAME_PICTURE = 1.0
"""Seconds between picture and detection up to which the detection is drawn into the picture."""


class CameraSheet(Sheet):
    """Shows the camera's pictures; the engine sends them only meanwhile."""

    TAKES_PICTURES: ClassVar[bool] = True

    def compose(self) -> ComposeResult:
        """Compose the picture."""
        with Vertical(classes="sheet") as sheet:
            sheet.border_title = "Camera"
            sheet.border_subtitle = "C or esc closes"
            yield Picture()

    def fill(self, shown: Shown) -> None:
        """Show the picture of a snapshot."""
        snapshot = shown.snapshot
        self.query_one(Picture).draw(snapshot, why_none(snapshot, replayed=shown.link.is_replay))
        if snapshot.image is not None:
            age = snapshot.time - snapshot.image.stamp
            model = snapshot.image.camera
            title = f"Camera  {model.width} × {model.height}, {age:.1f} s old"
            self.query_one(".sheet").border_title = title


def why_none(snapshot: Snapshot, *, replayed: bool) -> str:
    """Why there is no picture to show."""
    if replayed:
        return "no picture was taken before now"
    if not snapshot.cameras:
        return "this robot has no camera"
    if not any(camera.is_on for camera in snapshot.cameras):
        return "no behaviour asks for pictures now; --camera on takes them all the time"
    return "waiting for the first picture"


class Picture(Lines):
    """A picture in half blocks: two pixels above each other in a character."""

    EMPTY = "waiting for the robot"

    def draw(self, snapshot: Snapshot, without: str) -> None:
        """Draw the picture of a snapshot, or say why there is none."""
        columns, rows = self.size.width, self.size.height
        if columns < 4 or rows < 2:
            self.put([])
        elif snapshot.image is None:
            line = Strip([Segment(without.center(columns), ink(palette.DIM, italic=True))])
            self.put([Strip.blank(columns)] * (rows // 2) + [line])
        else:
            self.put(picture_strips(snapshot.image, snapshot.detections, columns, rows))


def picture_strips(
    image: Image, detections: tuple[Detection, ...], columns: int, rows: int
) -> list[Strip]:
    """A picture that fits into columns × rows characters, with boxes of the detections."""
    height, width = image.pixels.shape[:2]
    scale = min(columns / width, 2 * rows / height)
    across, down = max(2, round(width * scale)), max(2, round(height * scale / 2) * 2)
    row = (np.arange(down) + 0.5) * height / down
    column = (np.arange(across) + 0.5) * width / across
    shown = image.pixels[row.astype(int)][:, column.astype(int)].astype(np.uint32)
    packed = (shown[..., 0] << 16) | (shown[..., 1] << 8) | shown[..., 2]
    near = [item for item in detections if abs(item.stamp - image.stamp) <= SAME_PICTURE]
    ratio = across / image.camera.width
    for item in near:
        _frame(packed, *(round(side * ratio) for side in item.box))
    upper, lower = packed[0::2], packed[1::2]
    glyphs = np.full(upper.shape, HALF_BLOCK, dtype=np.uint32)
    for item in near:
        _write(glyphs, upper, lower, item, ratio)
    margin = Segment(" " * ((columns - across) // 2), paper(palette.BACKDROP))
    photo = Style(meta={PICTURE: True})
    return [Strip([margin, *strip.apply_style(photo)]) for strip in to_strips(glyphs, upper, lower)]


def _frame(packed: NDArray[np.uint32], left: int, top: int, right: int, bottom: int) -> None:
    height, width = packed.shape
    left, right = max(0, min(left, width - 1)), max(0, min(right, width - 1))
    top, bottom = max(0, min(top, height - 1)), max(0, min(bottom, height - 1))
    packed[top, left : right + 1] = packed[bottom, left : right + 1] = palette.DETECTION
    packed[top : bottom + 1, left] = packed[top : bottom + 1, right] = palette.DETECTION


def _write(
    glyphs: NDArray[np.uint32], upper: NDArray[np.uint32], lower: NDArray[np.uint32],
    item: Detection, ratio: float,
) -> None:  # fmt: skip
    """Write the label at the upper left corner of the box."""
    row = max(0, min(round(item.box[1] * ratio) // 2, glyphs.shape[0] - 1))
    first = max(0, round(item.box[0] * ratio))
    for column, glyph in enumerate(one_line(item.label), start=first):
        if column < glyphs.shape[1] and glyph.isascii():
            glyphs[row, column] = ord(glyph)
            upper[row, column], lower[row, column] = palette.BACKDROP, palette.DETECTION
