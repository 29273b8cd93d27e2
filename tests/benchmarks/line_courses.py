"""Random lines on the floor: curves both ways, a gap, a junction and an end mark."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import pairwise
from math import cos, degrees, pi, radians, sin

import numpy as np

from stack.streams import stream
from stack.types import FloatArray, Pose2D

STEP = 0.05
"""Metres from point to point of a line."""

CURVES = 6
RADII, TURNS = (0.6, 1.6), (radians(30.0), radians(95.0))
STRAIGHTS = (0.5, 1.3)
"""Metres, radians and metres; drawn evenly."""

GAPS = (0.2, 0.4)
FORKS, BRANCH_LENGTHS = (radians(30.0), radians(70.0)), (1.6, 2.4)
"""Angle of a branch at the junction, radians; its length, metres."""

APART = 1.1
"""Metres between two parts of a course that are not neighbours, at least."""

NEIGHBOURS = 1.6
"""Metres along the line within which two points are neighbours."""

MARGIN = 1.6
"""Metres from the line to the walls."""

BAR = 0.15
"""Half the length of the end mark, metres."""

MAIN = "straight"


@dataclass(frozen=True)
class LineCourse:
    """A course.

    Attributes:
        name: of its world.
        route: (n, 2) the line that the robot is to follow, across the gap, metres.
        lines: what is painted, each (n, 2).
        start: pose of the robot.
        branch: what `follow_line` is told for the junction: left | straight | right.
        gap: (2,) metres along the route, where the gap begins and ends.
        junction: metres along the route.
    """

    name: str
    route: FloatArray
    lines: tuple[FloatArray, ...]
    start: Pose2D
    branch: str
    gap: FloatArray
    junction: float

    def text(self, light: float) -> str:
        """Return the world file with a brightness."""
        points = np.concatenate(self.lines)
        (west, south), (east, north) = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
        walls = [[west, south], [east, south], [east, north], [west, north]]
        start = [self.start.x, self.start.y, f"{degrees(self.start.heading):.2f} deg"]
        return "\n".join([
            f"world: {self.name}", "format: 1", f"light: {light:g}", f"start: {json.dumps(start)}",
            "walls:", f"  - {{points: {json.dumps(np.round(walls, 2).tolist())}, closed: true}}",
            "lines:", *(f"  - {{points: {json.dumps(line.tolist())}}}" for line in self.lines), "",
        ])  # fmt: skip


def make_course(seed: int) -> LineCourse:
    """Return the course of a seed."""
    random = stream(seed, "line course")
    while True:
        course = _drawn(seed, random)
        if course is not None:
            return course


def _drawn(seed: int, random: np.random.Generator) -> LineCourse | None:
    """Return a random course; None if it has no room, or parts are too close to each other."""
    line, straights = _wound(random)
    if len(straights) < 2:
        return None
    gap_at, junction_at = (straights[n] for n in random.permutation(len(straights))[:2])
    is_main = bool(random.random() < 0.5)
    if not is_main:  # the gap is on the way to the branch
        gap_at, junction_at = sorted((gap_at, junction_at))
    branch, angle = _branch(line, junction_at, random)
    if not _is_apart(line) or not _is_off(branch, line, junction_at):
        return None
    width = float(random.uniform(*GAPS))
    along = STEP * np.arange(len(line))
    gap = np.array([gap_at - width / 2.0, gap_at + width / 2.0])
    before, after = line[along <= gap[0]], line[along >= gap[1]]
    route = line if is_main else np.concatenate([line[: round(junction_at / STEP)], branch])
    mark = _bar(route)
    begin = _heading(line, 0)
    start = Pose2D(float(line[0, 0]), float(line[0, 1]), begin).compose(
        Pose2D(-0.5, float(random.uniform(-0.1, 0.1)), float(random.uniform(-0.17, 0.17)))
    )
    side = "left" if angle > 0.0 else "right"
    return LineCourse(
        f"line_{seed}", route, tuple(np.round(one, 4) for one in (before, after, branch, mark)),
        Pose2D(round(start.x, 3), round(start.y, 3), start.heading), MAIN if is_main else side,
        gap, junction_at,
    )  # fmt: skip


def _wound(random: np.random.Generator) -> tuple[FloatArray, list[float]]:
    """Return a line of straights and arcs, and the middles of its inner straights along it."""
    pieces, middles, length = [np.zeros(round(1.2 / STEP))], [], 1.2
    for number in range(CURVES):
        radius, turn = random.uniform(*RADII), random.uniform(*TURNS)
        side = random.choice([-1.0, 1.0])
        pieces.append(np.full(round(radius * turn / STEP), side / radius))
        straight = float(random.uniform(*STRAIGHTS))
        pieces.append(np.zeros(round(straight / STEP)))
        length += STEP * len(pieces[-2])
        if number < CURVES - 1 and straight > 0.7:
            middles.append(length + straight / 2.0)
        length += STEP * len(pieces[-1])
    headings = np.cumsum(STEP * np.concatenate(pieces))
    steps = STEP * np.column_stack([np.cos(headings), np.sin(headings)])
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), middles


def _branch(line: FloatArray, at: float, random: np.random.Generator) -> tuple[FloatArray, float]:
    """Return a branch that bends off the line at a distance along it, and its angle."""
    number = round(at / STEP)
    angle = float(random.uniform(*FORKS)) * float(random.choice([-1.0, 1.0]))
    length, heading = float(random.uniform(*BRANCH_LENGTHS)), _heading(line, number) + angle
    along = np.arange(0.0, length, STEP)[:, None]
    return line[number] + along * [cos(heading), sin(heading)], angle


def _heading(line: FloatArray, number: int) -> float:
    step = line[number + 1] - line[number]
    return float(np.arctan2(step[1], step[0]))


def _bar(route: FloatArray) -> FloatArray:
    """Return the mark across the end of a route."""
    heading = _heading(route, len(route) - 2) + pi / 2.0
    across = BAR * np.array([cos(heading), sin(heading)])
    return np.array([route[-1] - across, route[-1] + across])


def _is_apart(line: FloatArray) -> bool:
    away = np.linalg.norm(line[:, None] - line, axis=2)
    numbers = np.arange(len(line))
    distant = np.abs(numbers[:, None] - numbers) * STEP > NEIGHBOURS
    return bool(away[distant].min() >= APART)


def _is_off(branch: FloatArray, line: FloatArray, at: float) -> bool:
    """Return whether a branch keeps away from the line beyond its junction."""
    distant = np.abs(STEP * np.arange(len(line)) - at) > NEIGHBOURS
    away = np.linalg.norm(branch[:, None] - line, axis=2)
    end = away[-1].min()
    return bool(away[:, distant].min() >= APART and end >= 0.7)


def cross_track(route: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return distances (n,) from a route, and how far along it each point (n, 2) is, metres."""
    ends = np.array(list(pairwise(route)))
    start, edge = ends[:, 0], ends[:, 1] - ends[:, 0]
    lengths = np.linalg.norm(edge, axis=1)
    reach = points[:, None] - start
    share = np.clip((reach * edge).sum(axis=2) / lengths**2, 0.0, 1.0)
    away = np.linalg.norm(reach - share[..., None] * edge, axis=2)
    nearest = away.argmin(axis=1)
    rows = np.arange(len(points))
    before = np.concatenate([[0.0], np.cumsum(lengths)])[nearest]
    return away[rows, nearest], before + share[rows, nearest] * lengths[nearest]
