"""A picture of a failed crossing: the world from above, the way driven, and where it ended."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from missions.bench.barn_score import GOAL_RADIUS, Crossing
from stack.sim.rasterise import rasterise
from stack.sim.world import World
from stack.types import FREE, OCCUPIED, FloatArray, Footprint, Pose2D

METRE = 50
"""Pixels."""

FLOOR, STANDING, UNREACHED = (245, 245, 245), (70, 60, 50), (225, 225, 225)
DRIVEN, ROBOT, GOAL = (200, 110, 30), (40, 40, 220), (90, 170, 60)
"""Blue, green, red."""


def draw_crossing(  # noqa: PLR0913 - one call from one place
    path: Path, world: World, trace: Sequence[Pose2D], footprint: Footprint, crossing: Crossing,
    goal: Pose2D,
) -> None:  # fmt: skip
    """Write a PNG.

    Args:
        path: of the PNG.
        world: that was crossed.
        trace: true poses, world frame.
        footprint: of the robot, drawn at its last pose.
        crossing: its figures, for the caption.
        goal: world frame.
    """
    import cv2

    grid = rasterise(world, 1.0 / METRE)
    pixels = np.full((*grid.cells.shape, 3), UNREACHED, np.uint8)
    pixels[grid.cells == FREE], pixels[grid.cells == OCCUPIED] = FLOOR, STANDING
    pixels = np.ascontiguousarray(pixels[::-1])

    def placed(points: FloatArray) -> Any:
        """(n, 2) metres as whole pixels, y downward."""
        x, y = ((points[:, :2] - grid.origin) * METRE).T
        return np.rint(np.column_stack([x, pixels.shape[0] - y])).astype(np.int32)

    way = placed(np.array([(pose.x, pose.y) for pose in trace]))
    cv2.polylines(pixels, [way], False, DRIVEN, 2, cv2.LINE_AA)
    target = placed(np.array([[goal.x, goal.y]]))[0]
    cv2.circle(pixels, target.tolist(), round(GOAL_RADIUS * METRE), GOAL, 2, cv2.LINE_AA)
    outline = placed(trace[-1].transform(footprint.points))
    cv2.polylines(pixels, [outline], True, ROBOT, 2, cv2.LINE_AA)
    caption = f"world {crossing.world} trial {crossing.trial}: {crossing.status}"
    font = cv2.FONT_HERSHEY_SIMPLEX
    cv2.putText(pixels, caption, (8, 20), font, 0.5, (0, 0, 0), 1, cv2.LINE_AA)
    done, png = cv2.imencode(".png", pixels)
    if done:
        path.write_bytes(png.tobytes())
