"""The arm on the map, from above: what is around it, its links, its way, the block in its hand."""

from __future__ import annotations

import numpy as np

from stack.telemetry.records import AROUND_ARM, Layer, SceneShape, Snapshot
from stack.types import ArmView, FloatArray, Pose2D, on_floor
from tui.drawing import palette
from tui.drawing.canvas import Canvas

REACH = 1.1
"""Metres around an arm that does not drive that the map shows."""


def draw_arm(canvas: Canvas, snapshot: Snapshot) -> None:
    """Draw the arm of a snapshot; nothing without one."""
    arm = snapshot.arm
    if arm is None:
        return
    for shape in _shapes(snapshot.layers.get(AROUND_ARM)):
        length, width, _ = shape.size
        canvas.draw_line(_rectangle(shape.pose, length, width), _packed(shape.colour))
    if len(arm.way):
        canvas.draw_line(snapshot.pose.transform(arm.way[:, :2]), palette.PATH)
    canvas.draw_line(snapshot.pose.transform(arm.links[:, :2]), palette.ROBOT)
    tool = snapshot.pose.transform(arm.tool[:2, 3][np.newaxis])[0]
    if arm.held is not None:
        canvas.draw_line(_held(snapshot.pose, arm), _packed(arm.held.colour))
    canvas.draw_text(float(tool[0]), float(tool[1]), "+", palette.ROBOT_TEXT)


def _shapes(layer: Layer | None) -> tuple[SceneShape, ...]:
    return layer.content if layer is not None and isinstance(layer.content, tuple) else ()


def _held(base: Pose2D, arm: ArmView) -> FloatArray:
    """Outline (5, 2) of the block in the hand, map frame."""
    assert arm.held is not None
    length, width, _ = arm.held.size.tolist()
    return base.transform(_rectangle(on_floor(arm.held.pose), length, width))


def _rectangle(pose: Pose2D, length: float, width: float) -> FloatArray:
    """Closed outline (5, 2) of a rectangle with its centre at a pose."""
    half = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * (length / 2.0, width / 2.0)
    return pose.transform(half)


def _packed(colour: tuple[float, float, float]) -> int:
    red, green, blue = (round(255 * part) for part in colour)
    return red << 16 | green << 8 | blue
