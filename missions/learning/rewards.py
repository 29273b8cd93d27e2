"""Rewards of an environment: declared terms with weights."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from missions.execution.run import Run
from stack.body import SimulatedWorld
from stack.geometry.polygons import distances_to_edges
from stack.parameters import parameter
from stack.telemetry.records import MissionState
from stack.types import Path, Pose2D


@dataclass(frozen=True)
class Rewards:
    """Weights of the terms of a reward; the reward of a step is their sum."""

    progress: float = parameter(
        1.0, help="for each metre by which the way to the goal becomes shorter"
    )
    time: float = parameter(-0.1, help="for each second")
    clearance: float = parameter(
        -0.5, help="for each second at an obstacle; less the farther it is, 0 from `near` on"
    )
    near: float = parameter(0.3, "m", above=0.0, help="distance from which `clearance` counts")
    collision: float = parameter(-5.0, help="for each contact while the robot drives")
    success: float = parameter(10.0, help="when the mission succeeds")
    failure: float = parameter(-10.0, help="when the mission fails")


@dataclass(frozen=True, slots=True)
class Standing:
    """What rewards depend on, at one time.

    Attributes:
        time: seconds.
        goal: of the drive, map frame; None without one.
        left: metres of way to it, by the path.
        clearance: metres between the outline and the nearest obstacle that is sensed; inf: none.
        collisions: contacts so far while the robot drove.
        state: of the mission.
    """

    time: float
    goal: Pose2D | None
    left: float
    clearance: float
    collisions: int
    state: MissionState

    @staticmethod
    def of(run: Run) -> Standing:
        """Return the standing of a run."""
        runtime, body = run.engine.runtime, run.engine.body
        perceived, navigator = runtime.perceived, runtime.parts.navigator
        points, pose = perceived.obstacles.points, perceived.estimate.pose
        outline = body.description.footprint.points
        return Standing(
            body.time,
            navigator.goal,
            0.0 if navigator.goal is None else _way(pose, navigator.path, navigator.goal),
            float(distances_to_edges(points, outline).min()) if len(points) else inf,
            body.tally.by_robot if isinstance(body, SimulatedWorld) else 0,
            runtime.state,
        )


def _way(pose: Pose2D, path: Path | None, goal: Pose2D) -> float:
    """Return the metres to the nearest point of the path and along it; straight without one."""
    if path is None:
        return pose.distance_to(goal)
    points = path.points[:, :2]
    away = np.hypot(*(points - (pose.x, pose.y)).T)
    nearest = int(away.argmin())
    rest = np.hypot(*np.diff(points[nearest:], axis=0).T)
    return float(away[nearest] + rest.sum())


def terms_of(rewards: Rewards, before: Standing, after: Standing) -> dict[str, float]:
    """Return the terms of the reward between two standings, by name."""
    seconds = after.time - before.time
    same = before.goal is not None and before.goal == after.goal
    closeness = max(0.0, 1.0 - max(0.0, after.clearance) / rewards.near)
    is_new = after.state != before.state
    return {
        "progress": rewards.progress * (before.left - after.left if same else 0.0),
        "time": rewards.time * seconds,
        "clearance": rewards.clearance * seconds * closeness,
        "collision": rewards.collision * (after.collisions - before.collisions),
        "success": rewards.success * (is_new and after.state is MissionState.SUCCESS),
        "failure": rewards.failure * (is_new and after.state is MissionState.FAILURE),
    }
