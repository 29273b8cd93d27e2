"""Courses that every controller has to drive: narrow places in a toy world, without contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi

from stack.components import component
from stack.planning.astar import Astar, AstarParameters
from stack.planning.kinematic.hybrid_astar import HybridAstar, HybridAstarParameters
from stack.types import Footprint, Pose2D
from tests.stack.control.driver import Driver
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import RECTANGLE, ToyWorld, moving

ROUND = Footprint.circle(0.22)
"""0.44 m wide. Rounds a corner between walls 1.3 times as far apart."""
BOX = RECTANGLE
"""0.5 m long, 0.4 m wide. Has to be aligned to pass a door 0.5 m wide; its diagonal is 0.64 m."""
WIDTHS = {"round": 1.3 * 0.44, "box": 1.3 * 0.5}
SHAPES = {"round": ROUND, "box": BOX}


@dataclass(frozen=True)
class Course:
    """Walls, a start and a goal."""

    walls: list[tuple[float, float, float, float]]
    start: Pose2D
    goal: Pose2D


def walls_along(*corners):
    """Segments that join corners in turn."""
    return [(*a, *b) for a, b in pairwise(corners)]


def s_bend(width: float) -> Course:
    """Into a corridor, round to the left, round to the right and out again."""
    w = width
    return Course(
        [
            *walls_along((0, 0), (3.0 + w, 0), (3.0 + w, 2.0), (6, 2.0)),
            *walls_along((0, w), (3.0, w), (3.0, 2.0 + w), (6, 2.0 + w)),
            (0, 0, 0, w), (6, 2.0, 6, 2.0 + w),
        ],
        Pose2D(0.5, w / 2), Pose2D(5.4, 2.0 + w / 2),
    )  # fmt: skip


def corner(width: float) -> Course:
    """A right angle to the left between walls."""
    w = width
    return Course(
        [
            *walls_along((0, 0), (3.0 + w, 0), (3.0 + w, 4), (3.0, 4), (3.0, w), (0, w), (0, 0)),
        ],
        Pose2D(0.5, w / 2), Pose2D(3.0 + w / 2, 3.4, pi / 2),
    )  # fmt: skip


def door(gap: float) -> Course:
    """A wall with a door 0.10 m wider than the robot, off the straight way."""
    low, high = 1.8 - gap / 2, 1.8 + gap / 2
    return Course(
        [
            *walls_along((0, 0), (6, 0), (6, 4), (0, 4), (0, 0)),
            (3.0, 0, 3.0, low), (3.0, high, 3.0, 4),
        ],
        Pose2D(0.8, 2.6), Pose2D(5.2, 1.2),
    )  # fmt: skip


COURSES = {"s-bend": s_bend, "corner": corner, "door": door}


def course(name: str, shape: str) -> Course:
    """A course as narrow as a shape of robot has to pass."""
    width = {"round": 0.44, "box": 0.4}[shape]
    return COURSES[name](width + 0.1 if name == "door" else WIDTHS[shape])


def controller(name: str, world: ToyWorld, **parameters):
    """A controller by name, as missions choose it, with its own progress on a path."""
    cls = component("controller", name)
    chosen = replace(cls.Parameters(), **parameters)
    return Driver(cls, chosen, world.robot, world.period)


def toy_drive(name, walls, start, shape="box", kind="differential", **parameters) -> ToyDrive:
    """Navigation in a toy world with a controller by name; a car plans poses."""
    world = ToyWorld(walls, moving(kind, SHAPES[shape]), start)
    if kind == "ackermann":
        radius = 1.2 * world.robot.turning_radius
        planner = HybridAstar(HybridAstarParameters(turning_radius=radius), world.robot)
    else:
        planner = Astar(AstarParameters(), world.robot)
    return ToyDrive(world, planner=planner, follower=controller(name, world, **parameters).follower)
