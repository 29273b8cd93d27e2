"""Picture of a failed run: world from above, driven path, final pose, and the cause."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from missions.bench.reporting import short
from missions.bench.trial import Trial
from missions.execution.prepare import PreparedMission
from stack.sim.worlds.rasterise import rasterise
from stack.types import FloatArray

PIXELS_PER_METRE = 50
"""Scale of a picture, unless the world would exceed LARGEST."""

LARGEST, SMALLEST = 1600, 480
"""Pixels of a picture's longer and shorter side."""

LINE, LETTER = 20, 8
"""Height of a line and width of a letter of the caption, pixels."""

FLOOR, OBSTACLE, UNREACHED = (245, 245, 245), (70, 60, 50), (225, 225, 225)
DRIVEN, ROBOT, GOAL, WALKER = (200, 110, 30), (40, 40, 220), (90, 170, 60), (190, 60, 160)
"""Colours in OpenCV's order: blue, green, red."""


def draw_trial(path: Path, plan: PreparedMission, trial: Trial) -> None:
    """Write the picture of a trial as PNG.

    Args:
        path: file to write.
        plan: the mission, with its world and robot.
        trial: the run.
    """
    import cv2

    x_min, y_min, x_max, y_max = plan.world.bounds
    scale = min(PIXELS_PER_METRE, LARGEST / (x_max - x_min), LARGEST / (y_max - y_min))
    grid = rasterise(plan.world, 1.0 / scale)
    pixels = np.full((*grid.cells.shape, 3), UNREACHED, np.uint8)
    pixels[grid.free], pixels[grid.occupied] = FLOOR, OBSTACLE
    pixels = np.ascontiguousarray(pixels[::-1])

    def to_pixels(points: FloatArray) -> Any:
        """Convert points (n, 2), metres, to pixels (n, 2), y downward."""
        x, y = ((points[:, :2] - grid.origin) * scale).T
        return np.rint(np.column_stack([x, pixels.shape[0] - y])).astype(np.int32)

    driven = to_pixels(np.array([(pose.x, pose.y) for pose in trial.trace]))
    cv2.polylines(pixels, [driven], False, DRIVEN, 2, cv2.LINE_AA)
    target = to_pixels(np.array([[trial.goal.x, trial.goal.y]]))[0]
    cv2.circle(pixels, target.tolist(), round(0.2 * scale), GOAL, 2, cv2.LINE_AA)
    for (x, y), radius in zip(to_pixels(trial.walkers), trial.walkers[:, 2], strict=True):
        cv2.circle(pixels, (int(x), int(y)), round(radius * scale), WALKER, 2, cv2.LINE_AA)
    outline = to_pixels(trial.trace[-1].transform(plan.robot.footprint.points))
    cv2.polylines(pixels, [outline], True, ROBOT, 2, cv2.LINE_AA)
    done, png = cv2.imencode(".png", _captioned(pixels, trial))
    if done:
        path.write_bytes(png.tobytes())


def _captioned(pixels: Any, trial: Trial) -> Any:
    """Return the picture with a caption above it."""
    import cv2

    run = trial.run
    width = max(SMALLEST, pixels.shape[1])
    caption = f"{short(run.setup)}, world {run.world} trial {run.trial}: {run.status}. {run.cause}"
    lines = wrap(caption, width // LETTER - 2)
    height = LINE * len(lines) + LINE // 2
    page = np.full((height + pixels.shape[0], width, 3), 255, np.uint8)
    page[height:, : pixels.shape[1]] = pixels
    for n, line in enumerate(lines, start=1):
        place = (LETTER, LINE * n)
        cv2.putText(page, line, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
    return page
