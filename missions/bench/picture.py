"""Pictures of runs: the world from above, the driven path, and the cause of a failure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from missions.execution.prepare import PreparedMission
from missions.map_picture import MapPicture
from stack.sim.worlds.rasterise import RESOLUTION, covered_cells, rasterise
from stack.types import FloatArray, Pose2D

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


def draw_run(path: Path, plan: PreparedMission, drawn: Drawn, caption: str) -> None:
    """Write a picture of a run as PNG; what the map does not show is violet.

    Args:
        path: file to write.
        plan: the mission, with its world and robot.
        drawn: true poses in blue, estimates in red, goals in green, bodies in violet.
        caption: text below the picture.
    """
    world = plan.world
    picture = MapPicture(rasterise(world))
    mapped = covered_cells(world, RESOLUTION, mapped_only=True)
    picture.fill(covered_cells(world, RESOLUTION) & ~mapped, UNMAPPED)
    picture.begin()
    for trace, colour in zip(drawn.traces, (DRIVEN, ESTIMATED), strict=False):
        if trace:
            picture.line([(pose.x, pose.y) for pose in trace], colour)
            outline = trace[-1].transform(plan.robot.footprint.points)
            picture.line(np.vstack([outline, outline[:1]]), colour)
    for goal in drawn.goals:
        picture.circle(goal.x, goal.y, 0.2, GOAL)
    for x, y, radius in drawn.bodies.tolist():
        picture.circle(x, y, radius, BODY)
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, caption)
