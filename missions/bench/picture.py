"""Pictures of runs: the world from above, the driven path, and the cause of a failure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from missions.execution.prepare import PreparedMission
from stack.sim.worlds.rasterise import rasterise
from stack.types import FloatArray, Pose2D

PIXELS_PER_METRE = 50
"""Scale of a picture, unless the world would exceed LARGEST."""

LARGEST, SMALLEST = 1600, 480
"""Pixels of a picture's longer and shorter side."""

LINE, LETTER = 20, 8
"""Height of a line and width of a letter of the caption, pixels."""

FLOOR, OBSTACLE, UNREACHED = (245, 245, 245), (70, 60, 50), (225, 225, 225)
UNMAPPED, GOAL, BODY = (200, 130, 200), (90, 170, 60), (190, 60, 160)
DRIVEN, ESTIMATED = (200, 110, 30), (40, 40, 220)
"""Colours in OpenCV's order: blue, green, red."""


@dataclass(frozen=True)
class Drawn:
    """What is drawn into a world, world frame, metres.

    Attributes:
        traces: true poses of the robot, and what it took them for; the latter may be missing.
        goals: poses.
        bodies: (n, 3) x, y and radius.
    """

    traces: Sequence[Sequence[Pose2D]]
    goals: Sequence[Pose2D] = ()
    bodies: FloatArray = field(default_factory=lambda: np.empty((0, 3)))


def draw_run(path: Path, plan: PreparedMission, drawn: Drawn, caption: Sequence[str]) -> None:
    """Write a picture of a run as PNG.

    Args:
        path: file to write.
        plan: the mission, with its world and robot.
        drawn: true poses in blue, estimates in red, goals in green, bodies in violet.
        caption: lines above the picture.
    """
    canvas = _Canvas(plan)
    for trace, colour in zip(drawn.traces, (DRIVEN, ESTIMATED), strict=False):
        if trace:
            canvas.line([(pose.x, pose.y) for pose in trace], colour)
            outline = trace[-1].transform(plan.robot.footprint.points)
            canvas.line(np.vstack([outline, outline[:1]]), colour)
    for goal in drawn.goals:
        canvas.circle(goal.x, goal.y, 0.2, GOAL)
    for x, y, radius in drawn.bodies.tolist():
        canvas.circle(x, y, radius, BODY)
    write_page(path, canvas.pixels, caption)


class _Canvas:
    """The world of a mission from above; what the map does not show is violet."""

    def __init__(self, plan: PreparedMission) -> None:
        self._bounds = np.reshape(plan.world.bounds, (2, 2))
        self._scale = min(PIXELS_PER_METRE, *(LARGEST / np.ptp(self._bounds, axis=0)))
        grid = rasterise(plan.world, 1.0 / self._scale)
        self._origin = np.asarray(grid.origin)
        pixels = np.full((*grid.cells.shape, 3), UNREACHED, np.uint8)
        pixels[grid.free], pixels[grid.occupied] = FLOOR, OBSTACLE
        self.pixels = np.ascontiguousarray(pixels[::-1])
        for box in plan.world.boxes:
            if not box.on_map:
                corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * box.size[:2] / 2.0
                self._fill(box.pose.transform(corners))
        for item in plan.world.cylinders:
            if not item.on_map:
                self.circle(item.x, item.y, item.radius, UNMAPPED, -1)

    def line(self, points: Any, colour: Any) -> None:
        """Draw a line through points (n, 2), world frame, metres."""
        import cv2

        cv2.polylines(self.pixels, [self._at(points)], False, colour, 2, cv2.LINE_AA)

    def circle(self, x: float, y: float, radius: float, colour: Any, thickness: int = 2) -> None:
        """Draw a circle; metres, its thickness in pixels, negative: filled."""
        import cv2

        centre = self._at([x, y])[0].tolist()
        cv2.circle(self.pixels, centre, round(radius * self._scale), colour, thickness, cv2.LINE_AA)

    def _fill(self, corners: Any) -> None:
        import cv2

        cv2.fillConvexPoly(self.pixels, self._at(corners), UNMAPPED)

    def _at(self, points: Any) -> Any:
        """Return the pixels (n, 2), y downward, at points (n, 2), within the world."""
        inside = np.clip(np.reshape(points, (-1, 2)), *self._bounds)
        x, y = ((inside - self._origin) * self._scale).T
        return np.rint(np.column_stack([x, self.pixels.shape[0] - y])).astype(np.int32)


def write_page(path: Path, pixels: Any, caption: Sequence[str]) -> None:
    """Write pixels (height, width, 3) with lines of text above them as PNG."""
    import cv2

    width = max(SMALLEST, pixels.shape[1])
    lines = [part for line in caption for part in wrap(line, width // LETTER - 2)]
    height = LINE * len(lines) + LINE // 2
    page = np.full((height + pixels.shape[0], width, 3), 255, np.uint8)
    page[height:, : pixels.shape[1]] = pixels
    for n, line in enumerate(lines, start=1):
        place = (LETTER, LINE * n)
        cv2.putText(page, line, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
    done, png = cv2.imencode(".png", page)
    if done:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(png.tobytes())
