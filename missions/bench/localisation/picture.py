"""Pictures of the bench: a run from above, and the reliability diagram of the health."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from missions.execution.prepare import PreparedMission
from stack.sim.worlds.rasterise import rasterise
from stack.types import FloatArray, Pose2D

FLOOR, WALL, UNMAPPED = (245, 245, 245), (70, 60, 50), (200, 130, 200)
TRUTH, ESTIMATE, TEXT = (200, 110, 30), (40, 40, 220), (30, 30, 30)
"""Colours in OpenCV's order: blue, green, red."""

LARGEST = 1200
"""Pixels of a picture's longer side."""


def draw_case(
    path: Path, plan: PreparedMission, trace: Sequence[tuple[Pose2D, Pose2D]], caption: list[str]
) -> None:
    """Write a picture: true poses in blue, estimates in red, unmapped obstacles in violet.

    Args:
        path: file to write, PNG.
        plan: the mission with its world.
        trace: truth and estimate at each sample.
        caption: lines above the picture.
    """
    import cv2

    x_min, y_min, x_max, y_max = plan.world.bounds
    scale = min(60.0, LARGEST / (x_max - x_min), LARGEST / (y_max - y_min))
    grid = rasterise(plan.world, 1.0 / scale)
    pixels = np.full((*grid.cells.shape, 3), 225, np.uint8)
    pixels[grid.free], pixels[grid.occupied] = FLOOR, WALL
    pixels = np.ascontiguousarray(pixels[::-1])

    def to_pixels(points: FloatArray) -> Any:
        x, y = ((points[:, :2] - grid.origin) * scale).T
        return np.rint(np.column_stack([x, pixels.shape[0] - y])).astype(np.int32)

    for box in plan.world.boxes:
        if not box.on_map:
            half = np.array(box.size[:2]) / 2.0
            corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
            cv2.fillConvexPoly(pixels, to_pixels(box.pose.transform(corners)), UNMAPPED)
    for cylinder in plan.world.cylinders:
        if not cylinder.on_map:
            (x, y) = to_pixels(np.array([[cylinder.x, cylinder.y]]))[0].tolist()
            cv2.circle(pixels, (x, y), round(cylinder.radius * scale), UNMAPPED, -1)
    for colour, which in ((TRUTH, 0), (ESTIMATE, 1)):
        poses = np.array([(pair[which].x, pair[which].y) for pair in trace] or [(0.0, 0.0)])
        poses = np.clip(poses, (x_min, y_min), (x_max, y_max))
        cv2.polylines(pixels, [to_pixels(poses)], False, colour, 2, cv2.LINE_AA)
        end = to_pixels(poses[-1:])[0].tolist()
        cv2.circle(pixels, end, round(0.22 * scale), colour, 2, cv2.LINE_AA)
    _write(path, pixels, caption)


def draw_reliability(path: Path, bins: FloatArray, error: float) -> None:
    """Write the reliability diagram: share of right poses over the health, with the diagonal.

    Args:
        path: file to write, PNG.
        bins: (n, 3): samples, sum of the health, right samples.
        error: expected calibration error.
    """
    import cv2

    side, margin = 480, 40
    pixels = np.full((side + 2 * margin, side + 2 * margin, 3), 255, np.uint8)

    def at(x: float, y: float) -> tuple[int, int]:
        return margin + round(x * side), margin + side - round(y * side)

    cv2.rectangle(pixels, at(0, 0), at(1, 1), TEXT, 1)
    cv2.line(pixels, at(0, 0), at(1, 1), (190, 190, 190), 1, cv2.LINE_AA)
    total = max(1.0, float(bins[:, 0].sum()))
    for number, (count, health, right) in enumerate(bins.tolist()):
        if not count:
            continue
        low, high = number / len(bins), (number + 1) / len(bins)
        cv2.rectangle(pixels, at(low, 0), at(high, right / count), (225, 200, 170), -1)
        cv2.rectangle(pixels, at(low, 0), at(high, right / count), TRUTH, 1)
        cv2.circle(pixels, at(health / count, right / count), 4, ESTIMATE, -1, cv2.LINE_AA)
        share = f"{count / total:.1%}"
        cv2.putText(pixels, share, (at(low, 0)[0] + 2, at(0, 0)[1] + 15),
                    cv2.FONT_HERSHEY_SIMPLEX, 0.32, TEXT, 1, cv2.LINE_AA)  # fmt: skip
    caption = [
        "Share of right poses (0.3 m, 10 degrees) over the health",
        f"{total:.0f} samples, expected calibration error {error:.3f}; below: share of samples",
    ]
    _write(path, pixels, caption)


def _write(path: Path, pixels: Any, caption: list[str]) -> None:
    """Write a picture with lines of text above it."""
    import cv2

    width = max(700, pixels.shape[1])
    lines = [line[n : n + width // 8] for line in caption for n in range(0, len(line), width // 8)]
    head = 18 * len(lines) + 10
    page = np.full((head + pixels.shape[0], width, 3), 255, np.uint8)
    page[head:, : pixels.shape[1]] = pixels
    for number, line in enumerate(lines, 1):
        cv2.putText(page, line, (6, 18 * number), cv2.FONT_HERSHEY_SIMPLEX, 0.42, TEXT, 1,
                    cv2.LINE_AA)  # fmt: skip
    done, png = cv2.imencode(".png", page)
    if done:
        path.write_bytes(png.tobytes())
