"""Detected objects in rerun: boxes in the picture, points on the map, and the mask of a colour."""

from __future__ import annotations

import numpy as np
import rerun as rr

from stack.telemetry.rerun.pictures import PICTURE
from stack.telemetry.rerun.recording import Recording
from stack.types import ColourMask, Detection

BOX_COLOUR = (255, 160, 60)
MASK_COLOUR = (80, 255, 120)
MASK_OPACITY = 0.5

BOXES, POINTS, MASK = "world/camera/objects", "world/objects", "world/camera/mask"

HEIGHT, RADIUS = 0.05, 0.06
"""Metres, of the points on the map."""


def draw_detections(recording: Recording, detections: tuple[Detection, ...]) -> None:
    """Draw detections; hide the last ones if there are none."""
    if not detections:
        recording.hide(BOXES)
        recording.hide(POINTS)
        return
    recording.frame(BOXES, PICTURE)
    corners = np.array([item.box for item in detections], dtype=np.float64)
    names = [_name(item) for item in detections]
    sides = corners[:, 2:] - corners[:, :2]
    boxes = rr.Boxes2D(
        centers=corners[:, :2] + sides / 2.0, sizes=sides, labels=names, colors=BOX_COLOUR,
        show_labels=True,
    )  # fmt: skip
    recording.show(BOXES, boxes)
    places = [(*item.position, HEIGHT) for item in detections]
    dots = rr.Points3D(places, radii=RADIUS, labels=names, colors=BOX_COLOUR, show_labels=True)
    recording.show(POINTS, dots)


def draw_mask(recording: Recording, mask: ColourMask | None) -> None:
    """Draw the pixels that a colour detector found over the picture; None hides them."""
    if mask is None:
        recording.hide(MASK)
        return
    if recording.frame(MASK, PICTURE):
        classes = rr.AnnotationContext([(0, "", (0, 0, 0, 0)), (1, mask.label, MASK_COLOUR)])
        recording.stream.log(MASK, classes, static=True)
    recording.show(MASK, rr.SegmentationImage(mask.pixels, opacity=MASK_OPACITY, draw_order=1.0))


def _name(detection: Detection) -> str:
    score = f" {detection.score:.0%}" if detection.score < 1.0 else ""
    return f"{detection.label}{score}"
