"""A picture of a failed run: the world from above, the way driven, where it ended, and why."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from missions.bench.reporting import short
from missions.bench.trial import Trial
from missions.execution.prepare import PreparedMission
from stack.sim.worlds.rasterise import rasterise
from stack.types import FREE, OCCUPIED, FloatArray

METRE = 50
"""Pixels, in a world that fits into LARGEST."""

LARGEST, SMALLEST = 1600, 480
"""Pixels of a picture's longer and shorter side."""

LINE, LETTER = 20, 8
"""Pixels that a line and a letter of the caption take."""

FLOOR, STANDING, UNREACHED = (245, 245, 245), (70, 60, 50), (225, 225, 225)
DRIVEN, ROBOT, GOAL, WALKER = (200, 110, 30), (40, 40, 220), (90, 170, 60), (190, 60, 160)
"""Blue, red, green, violet (as OpenCV has them: blue first)."""


def draw_story(path: Path, plan: PreparedMission, story: Trial) -> None:
    """Write a PNG.

    Args:
        path: of the PNG.
        plan: its world and footprint, and where the run began.
        story: the run.
    """
    import cv2

    x_min, y_min, x_max, y_max = plan.world.bounds
    metre = min(METRE, LARGEST / (x_max - x_min), LARGEST / (y_max - y_min))
    grid = rasterise(plan.world, 1.0 / metre)
    pixels = np.full((*grid.cells.shape, 3), UNREACHED, np.uint8)
    pixels[grid.cells == FREE], pixels[grid.cells == OCCUPIED] = FLOOR, STANDING
    pixels = np.ascontiguousarray(pixels[::-1])

    def placed(points: FloatArray) -> Any:
        """(n, 2) metres as whole pixels, y downward."""
        x, y = ((points[:, :2] - grid.origin) * metre).T
        return np.rint(np.column_stack([x, pixels.shape[0] - y])).astype(np.int32)

    way = placed(np.array([(pose.x, pose.y) for pose in story.trace]))
    cv2.polylines(pixels, [way], False, DRIVEN, 2, cv2.LINE_AA)
    target = placed(np.array([[story.goal.x, story.goal.y]]))[0]
    cv2.circle(pixels, target.tolist(), round(0.2 * metre), GOAL, 2, cv2.LINE_AA)
    for (x, y), radius in zip(placed(story.walkers), story.walkers[:, 2], strict=True):
        cv2.circle(pixels, (int(x), int(y)), round(radius * metre), WALKER, 2, cv2.LINE_AA)
    outline = placed(story.trace[-1].transform(plan.robot.footprint.points))
    cv2.polylines(pixels, [outline], True, ROBOT, 2, cv2.LINE_AA)
    done, png = cv2.imencode(".png", _captioned(pixels, story))
    if done:
        path.write_bytes(png.tobytes())


def _captioned(pixels: Any, story: Trial) -> Any:
    """The picture below what is said about it."""
    import cv2

    run = story.run
    wide = max(SMALLEST, pixels.shape[1])
    said = f"{short(run.setup)}, world {run.world} trial {run.trial}: {run.status}. {run.cause}"
    lines = wrap(said, wide // LETTER - 2)
    high = LINE * len(lines) + LINE // 2
    page = np.full((high + pixels.shape[0], wide, 3), 255, np.uint8)
    page[high:, : pixels.shape[1]] = pixels
    for n, line in enumerate(lines, start=1):
        place = (LETTER, LINE * n)
        cv2.putText(page, line, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
    return page
