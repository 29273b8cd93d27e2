"""Narrow passages scaled to a robot, slightly different in every trial.

Widths are multiples of the robot's width: the diameter of the inscribed circle of its footprint.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, radians, sin

from numpy.random import Generator

from missions.bench.layout import Layout, Point
from stack.drivetrain.description import RobotDescription
from stack.streams import stream
from stack.types import Footprint, Pose2D

TILT = radians(10.0)
"""Largest rotation of a course against the grid of a map, radians; its offset in a cell is random.
"""

WALL = 0.1
"""Thickness of the walls, metres."""


@dataclass(frozen=True, slots=True)
class Size:
    """Size of a robot, metres: width, and the diameter it needs to turn in place."""

    width: float
    turning: float

    @staticmethod
    def of(footprint: Footprint) -> Size:
        """Return the diameters of the inscribed and the circumscribed circle."""
        return Size(2.0 * footprint.inscribed_radius, 2.0 * footprint.circumscribed_radius)


@dataclass(frozen=True, slots=True)
class Course:
    """A type of narrow passage.

    Attributes:
        doc: one-line description.
        mapped: whether the robot has a map of it.
        build: returns the layout for a robot's size and random numbers.
    """

    name: str
    doc: str
    mapped: bool
    build: Callable[[Size, Generator], Layout]

    def text(self, robot: RobotDescription, trial: int) -> str:
        """Return the world file of a trial."""
        random = stream(trial, f"course {self.name}")
        layout = self.build(Size.of(robot.footprint), random)
        if random.random() < 0.5:
            layout = layout.mirrored()
        x, y = random.uniform(0.0, 0.05, 2)
        at = Pose2D(float(x), float(y), random.uniform(-TILT, TILT))
        return layout.text(f"{self.name} {trial} for {robot.name}", self.doc, at)


def door(size: Size, random: Generator) -> Layout:
    """Return two rooms, connected by a gap 0.10 m wider than the robot."""
    gap, middle = size.width + 0.1, random.uniform(0.9, 2.1)
    south, north = middle - gap / 2, middle + gap / 2
    return Layout(
        Pose2D(random.uniform(0.7, 1.2), random.uniform(0.8, 2.2), random.uniform(-0.6, 0.6)),
        Pose2D(random.uniform(4.8, 5.3), random.uniform(0.8, 2.2), random.uniform(-0.6, 0.6)),
        [
            ([(0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (0.0, 3.0)], True),
            ([(3.0, 0.0), (3.0, south)], False),
            ([(3.0, north), (3.0, 3.0)], False),
        ],
        thickness=WALL,
    )


def s_bend(size: Size, random: Generator) -> Layout:
    """Return a corridor 1.4 robots wide with two opposite right-angle bends."""
    width, radius = 1.4 * size.width, random.uniform(0.7, 1.0)
    first, last = random.uniform(1.2, 1.6), random.uniform(1.2, 1.6)
    bend = [i * pi / 12 for i in range(7)]
    centreline = [(0.0, 0.0, 0.0)]
    centreline += [(first + radius * sin(a), radius * (1.0 - cos(a)), a) for a in bend]
    centreline += [
        (first + radius * (2.0 - cos(a)), radius * (1.0 + sin(a)), pi / 2 - a) for a in bend[1:]
    ]
    end = first + 2.0 * radius + last
    centreline.append((end, 2.0 * radius, 0.0))
    offset = random.uniform(-0.02, 0.02)
    return Layout(
        Pose2D(0.55, offset, random.uniform(-0.1, 0.1)),
        Pose2D(end - 0.55, 2.0 * radius, 0.0),
        [(_corridor(centreline, width), True)],
        thickness=WALL,
    )


def corner(size: Size, random: Generator) -> Layout:
    """Return a right angle in a corridor 1.3 robots wide."""
    width = 1.3 * size.width
    first, last = random.uniform(1.6, 2.2), random.uniform(1.6, 2.2)
    half = (width + WALL) / 2
    offset = random.uniform(-0.02, 0.02)
    outline = [
        (0.0, -half), (first + half, -half), (first + half, last),
        (first - half, last), (first - half, half), (0.0, half),
    ]  # fmt: skip
    return Layout(
        Pose2D(0.55, offset, random.uniform(-0.1, 0.1)),
        Pose2D(first, last - 0.55, pi / 2),
        [(outline, True)],
        thickness=WALL,
    )


def dead_end(size: Size, random: Generator) -> Layout:
    """Return a U-shaped wall between start and goal; the start is in front of it or inside it."""
    depth, half = random.uniform(1.8, 3.0), random.uniform(0.8, 1.2)
    back = 2.0 + depth
    middle = random.uniform(-0.5, 0.5)
    around = half + 0.6 + size.turning
    return Layout(
        Pose2D(random.uniform(0.0, back - 0.9), middle, random.uniform(-0.4, 0.4)),
        Pose2D(back + random.uniform(1.2, 1.8), random.uniform(-0.3, 0.3), 0.0),
        [
            ([(2.0, middle - half), (back, middle - half), (back, middle + half),
              (2.0, middle + half)], False),
            ([(-1.5, middle - around), (back + 3.0, middle - around),
              (back + 3.0, middle + around), (-1.5, middle + around)], True),
        ],
        thickness=WALL,
    )  # fmt: skip


def clutter(size: Size, random: Generator) -> Layout:
    """Return posts and crates with gaps in which the robot can turn; half are not on the map."""
    length, width, gap = 7.0, 4.0, size.turning + 0.12
    start = Pose2D(0.6, random.uniform(1.0, 3.0), random.uniform(-0.6, 0.6))
    goal = Pose2D(length - 0.6, random.uniform(1.0, 3.0), 0.0)
    layout = Layout(start, goal, thickness=WALL)
    layout.walls.append(([(0.0, 0.0), (length, 0.0), (length, width), (0.0, width)], True))
    placed = [(start.x, start.y, 0.1), (goal.x, goal.y, 0.1)]
    for number in range(120):
        x, y = random.uniform(0.0, length), random.uniform(0.0, width)
        radius, heading = random.uniform(0.06, 0.3), random.uniform(-pi, pi)
        room = min(x, y, length - x, width - y) - WALL / 2 - radius
        apart = min(((x - a) ** 2 + (y - b) ** 2) ** 0.5 - r - radius for a, b, r in placed)
        if min(room, apart) < gap:
            continue
        placed.append((x, y, radius))
        if number % 2:
            posts = layout.posts if number % 4 == 1 else layout.hidden_posts
            posts.append((x, y, radius))
        else:
            crates = layout.crates if number % 4 == 0 else layout.hidden_crates
            sides = 2.0 * radius * cos(pi / 5), 2.0 * radius * sin(pi / 5)
            crates.append((Pose2D(x, y, heading), *sides))
    return layout


def _corridor(centreline: list[tuple[float, float, float]], width: float) -> list[Point]:
    """Return the centreline of the walls around a corridor: the right side, then the left back."""
    half = (width + WALL) / 2
    left = [(x - half * sin(a), y + half * cos(a)) for x, y, a in centreline]
    right = [(x + half * sin(a), y - half * cos(a)) for x, y, a in centreline]
    return right + left[::-1]


COURSES = {
    course.name: course
    for course in (
        Course("door", "a door 0.10 m wider than the robot", True, door),
        Course("s_bend", "an S-bend in a corridor 1.4 robots wide", True, s_bend),
        Course("corner", "a right angle in a corridor 1.3 robots wide", True, corner),
        Course("dead_end", "a U-shaped dead end, start before or in it, no map", False, dead_end),
        Course("clutter", "posts and crates, half of them not on the map", True, clutter),
    )
}
