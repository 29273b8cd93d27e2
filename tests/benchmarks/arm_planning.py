"""Paths of an arm around obstacles: share solved, times, durations of the motions.

`python -m tests.benchmarks.arm_planning [PROBLEMS]` prints the tables. A problem is a table with a
wall, poles and a shelf drawn from the seed, and two poses of the tool whose positions are free, but
not the straight motion between them.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import pairwise
from time import process_time

import numpy as np
import ruckig

from stack.errors import NavigationError
from stack.geometry.rotations import from_angles
from stack.manipulation.braking import is_within
from stack.manipulation.collisions import Collisions
from stack.manipulation.model import ArmModel
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.scene import Box, Cylinder, Scene, SceneObject
from stack.manipulation.timing import first_contact, time_path, timed
from stack.streams import stream
from stack.types import FloatArray
from tests.benchmarks.table import Rows
from tests.stack.manipulation.panda import HOME, panda

PROBLEMS = 100
CLEARANCE = 0.02
"""Metres that start and goal keep, so that the planner's clearance never has to shrink."""


@dataclass(frozen=True)
class Problem:
    """A scene, and free positions (n,) of the joints to go from and to."""

    seed: int
    scene: Scene
    start: FloatArray
    goal: FloatArray


@dataclass(frozen=True)
class Solution:
    """What was planned for a problem.

    Attributes:
        path: waypoints (k, n); None: nothing was found.
        planning: seconds of processor time. timing: likewise.
        duration: of the motion, seconds. stopping: if the arm stops at each waypoint.
        ruckig: seconds that Ruckig needs for the latter.
        rounding: radians by which corners are rounded.
        is_sound: whether the motion is free and within the limits.
    """

    path: FloatArray | None
    planning: float
    timing: float = 0.0
    duration: float = 0.0
    stopping: float = 0.0
    ruckig: float = 0.0
    rounding: float = 0.0
    is_sound: bool = False


def scene_of(generator: np.random.Generator) -> Scene:
    """Return a table with a wall, poles and a shelf, of random places and sizes."""
    uniform = generator.uniform
    objects = [
        SceneObject("table", Box((1.2, 1.8, 0.04)), from_angles((0.75, 0, -0.02), (0, 0, 0)))
    ]
    wall = uniform((0.35, -0.35, 0.0), (0.6, 0.35, 0.0))
    height = uniform(0.2, 0.45)
    objects.append(
        SceneObject(
            "wall",
            Box((uniform(0.3, 0.6), 0.03, height)),
            from_angles((wall[0], wall[1], height / 2.0), (0, 0, uniform(-0.5, 0.5))),
        )
    )
    for number in range(generator.integers(1, 4)):
        radius, angle = uniform(0.4, 0.75), uniform(-1.4, 1.4)
        place = (radius * np.cos(angle), radius * np.sin(angle), 0.3)
        objects.append(
            SceneObject(f"pole {number}", Cylinder(0.025, 0.6), from_angles(place, (0, 0, 0)))
        )
    side = float(generator.choice((-1.0, 1.0)))
    for number, level in enumerate((0.25, 0.55, 0.85)):
        objects.append(
            SceneObject(
                f"board {number}",
                Box((0.5, 0.3, 0.02)),
                from_angles((0.35, side * 0.75, level), (0, 0, 0)),
            )
        )
    return Scene(tuple(objects))


def problem(model: ArmModel, seed: int) -> Problem:
    """Return the problem of a seed."""
    generator = stream(seed, "arm problem")
    planner, scene = ArmPlanner(model), scene_of(generator)
    checks = Collisions(model, scene, CLEARANCE)
    ends: list[FloatArray] = []
    while len(ends) < 2 or checks.is_free(*ends):
        ends = ends[:1]
        x, y, z = generator.uniform((0.2, -0.7, 0.08), (0.75, 0.7, 0.75))
        tilt = generator.uniform(0.0, 1.6)
        target = from_angles((x, y, z), (0.0, np.pi - tilt, generator.uniform(-1.0, 1.0)))
        found = planner.kinematics.ik(target, HOME, generator, 3)
        if found is not None and not checks.collides(found):
            ends.append(found)
    return Problem(seed, scene, ends[0], ends[1])


def solve(model: ArmModel, item: Problem) -> Solution:
    """Plan and time the motion of a problem."""
    planner, limits = ArmPlanner(model), model.description.limits
    begin = process_time()
    try:
        path = planner.plan(item.start, [item.goal], item.scene, stream(item.seed, "plan"))
    except NavigationError:
        return Solution(None, process_time() - begin)
    planned = process_time()
    checks = Collisions(model, item.scene, planner.clearance)
    motion, rounding = timed(path, limits, checks)
    done = process_time()
    return Solution(
        path,
        planned - begin,
        done - planned,
        motion.duration,
        time_path(path, limits, 0.0).duration,
        sum(ruckig_duration(*line) for line in pairwise(path)),
        rounding,
        not first_contact(motion, Collisions(model, item.scene, 0.002))
        and is_within(motion, limits, 1.0 + 1e-6),
    )


def ruckig_duration(start: FloatArray, end: FloatArray) -> float:
    """Return the seconds that Ruckig takes along the line between two positions (n,)."""
    limits = panda().description.limits
    given = ruckig.InputParameter(len(start))
    given.synchronization = ruckig.Synchronization.Phase
    given.current_position, given.target_position = start, end
    given.max_velocity, given.max_acceleration = limits.velocity, limits.acceleration
    given.max_jerk = limits.jerk
    motion = ruckig.Trajectory(len(start))
    ruckig.Ruckig(len(start)).calculate(given, motion)
    return float(motion.duration)


def run(count: int = PROBLEMS) -> Rows:
    """Return the figures of the problems of the first seeds."""
    model = panda()
    problems = [problem(model, seed) for seed in range(count)]
    solve(model, problems[0])  # loads the kernels
    solutions = [solve(model, item) for item in problems]
    again = [solve(model, item) for item in problems[: max(1, count // 10)][::-1]][::-1]
    solved = [item for item in solutions if item.path is not None]
    planning = np.array([item.planning for item in solutions])
    same = all(
        np.array_equal(first.path, second.path)
        for first, second in zip(solutions, again, strict=False)
    )
    total = {
        name: sum(getattr(item, name) for item in solved)
        for name in ("duration", "stopping", "ruckig")
    }
    figures: dict[str, float | str] = {
        "problems": count,
        "solved_%": 100.0 * len(solved) / count,
        "sound_%": 100.0 * sum(item.is_sound for item in solved) / max(1, len(solved)),
        "plan_median_s": float(np.median(planning)),
        "plan_p95_s": float(np.percentile(planning, 95)),
        "plan_worst_s": float(planning.max()),
        "timing_median_s": float(np.median([item.timing for item in solved])),
        "motion_s": total["duration"] / len(solved),
        "stopping_s": total["stopping"] / len(solved),
        "ruckig_stopping_s": total["ruckig"] / len(solved),
        "rounded_%": 100.0 * sum(item.rounding > 0.0 for item in solved) / len(solved),
        "same_path_again": "yes" if same else "NO",
    }
    return [figures]


if __name__ == "__main__":
    for row in run(int(sys.argv[1]) if len(sys.argv) > 1 else PROBLEMS):
        for name, value in row.items():
            print(f"{name:20} {value if isinstance(value, str | int) else round(value, 3)}")
