"""Simulated office as a fine array, with a lidar and wheel odometry."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

import numpy as np

from stack.localisation.kernels import cast_rays
from stack.types import FREE, OCCUPIED, OccupancyGrid, Pose2D, Scan

FINE = 0.01
WIDTH, DEPTH = 12.0, 9.0
LIDAR_NOISE = 0.01
MOUNT = Pose2D(0.1, 0.0, 0.0)

WALLS = [
    (0.0, 0.0, 12.0, 0.1), (0.0, 8.9, 12.0, 9.0), (0.0, 0.0, 0.1, 9.0), (11.9, 0.0, 12.0, 9.0),
    # corridor from x = 0 to 12 between y = 3.9 and 5.2, doors of 0.9 m
    (0.0, 3.8, 1.6, 3.9), (2.5, 3.8, 5.3, 3.9), (6.2, 3.8, 9.3, 3.9), (10.2, 3.8, 12.0, 3.9),
    (0.0, 5.2, 2.2, 5.3), (3.1, 5.2, 7.3, 5.3), (8.2, 5.2, 12.0, 5.3),
    # between the rooms
    (3.9, 0.0, 4.0, 3.8), (7.9, 0.0, 8.0, 3.8), (5.4, 5.2, 5.5, 9.0),
]  # fmt: skip
FURNITURE = [
    (0.1, 0.1, 0.9, 1.7), (2.9, 0.1, 3.9, 0.5), (4.0, 2.2, 4.6, 3.8), (6.2, 0.8, 7.2, 1.4),
    (8.0, 0.1, 8.4, 1.9), (10.4, 1.0, 11.4, 1.8), (10.9, 3.2, 11.9, 3.8), (0.1, 7.4, 1.5, 8.1),
    (3.0, 8.3, 5.4, 8.9), (4.3, 6.3, 4.9, 6.9), (6.6, 6.6, 8.6, 7.6), (10.7, 5.3, 11.9, 5.9),
    (11.4, 7.6, 11.9, 8.9), (5.5, 8.5, 6.3, 8.9), (0.1, 5.0, 0.5, 5.2), (11.2, 3.9, 11.9, 4.1),
]  # fmt: skip
DOORS = [(1.6, 3.82, 2.5, 3.88), (5.3, 3.82, 6.2, 3.88), (9.3, 3.82, 10.2, 3.88),
         (2.2, 5.22, 3.1, 5.28), (7.3, 5.22, 8.2, 5.28)]  # fmt: skip

TWIN_WALLS = [
    (0.0, 0.0, 10.2, 0.1), (0.0, 0.0, 0.1, 6.0), (10.1, 0.0, 10.2, 6.0), (0.0, 5.9, 10.2, 6.0),
    (5.05, 0.0, 5.15, 6.0),
]  # fmt: skip
TWIN_FURNITURE = [(0.1, 0.1, 1.1, 0.7), (3.6, 2.2, 4.4, 3.4), (1.4, 5.3, 2.6, 5.9)]


@dataclass
class Place:
    """True obstacles of an office and its map."""

    solid: np.ndarray
    grid: OccupancyGrid
    people: list[tuple[float, float, float]] = field(default_factory=list)

    def scan(self, pose: Pose2D, stamp: float, generator: np.random.Generator) -> Scan:
        """Simulate 360 beams, 12 m, 1 cm noise, 0.5 % lost, people as circles (x, y, radius)."""
        angles = -pi + 2 * pi / 360 * np.arange(360)
        sensor = pose.compose(MOUNT)
        row = np.array([sensor.x, sensor.y, sensor.heading])
        ranges = cast_rays(self.solid, (FINE, 0.0, 0.0), row, angles, 12.0)
        for x, y, radius in self.people:
            to = np.array([x - sensor.x, y - sensor.y])
            along = to[0] * np.cos(angles + sensor.heading) + to[1] * np.sin(
                angles + sensor.heading
            )
            beside = to @ to - along**2
            near = along - np.sqrt(np.maximum(radius**2 - beside, 0.0))
            ranges = np.where((beside < radius**2) & (near > 0), np.minimum(ranges, near), ranges)
        ranges = ranges + generator.normal(0.0, LIDAR_NOISE, ranges.size)
        ranges[generator.random(ranges.size) < 0.005] = np.inf
        ranges[ranges < 0.08] = np.nan
        return Scan(stamp, ranges.astype(np.float32), -pi, 2 * pi / 360, 0.08, 12.0, MOUNT)

    def is_clear(self, x: float, y: float, radius: float = 0.3) -> bool:
        """Return whether a square of this half width is free of obstacles."""
        low_row, low_column = int((y - radius) / FINE), int((x - radius) / FINE)
        high_row, high_column = int((y + radius) / FINE), int((x + radius) / FINE)
        if min(low_row, low_column) < 0:
            return False
        if high_row >= self.solid.shape[0] or high_column >= self.solid.shape[1]:
            return False
        return not self.solid[low_row:high_row, low_column:high_column].any()

    def free_pose(self, generator: np.random.Generator) -> Pose2D:
        """Return a random pose with 0.3 m of clearance."""
        while True:
            x = generator.uniform(0.0, self.solid.shape[1] * FINE)
            y = generator.uniform(0.0, self.solid.shape[0] * FINE)
            if self.is_clear(x, y):
                return Pose2D(float(x), float(y), float(generator.uniform(-pi, pi)))


def drawn(rectangles, width: float, depth: float) -> np.ndarray:
    """(rows, columns) uint8 at 1 cm: 1 inside any rectangle (x0, y0, x1, y1)."""
    solid = np.zeros((round(depth / FINE), round(width / FINE)), dtype=np.uint8)
    for x0, y0, x1, y1 in rectangles:
        solid[round(y0 / FINE) : round(y1 / FINE), round(x0 / FINE) : round(x1 / FINE)] = 1
    return solid


def mapped(solid: np.ndarray) -> OccupancyGrid:
    """Return a 5 cm map: a cell is occupied if its centre is."""
    cells = np.where(solid[2::5, 2::5] == 1, OCCUPIED, FREE).astype(np.int8)
    return OccupancyGrid(cells, 0.05)


def uneven(rectangles):
    """Move each side of the rectangles by up to 2.5 cm, so that none is aligned with the map."""
    generator = np.random.default_rng(5)
    return [
        tuple(side + generator.uniform(-0.025, 0.025) if side > 0.1 else side for side in rectangle)
        for rectangle in rectangles
    ]


def office(*, unmapped=()) -> Place:
    """Five rooms on a corridor; `unmapped` rectangles are not on the map."""
    known = uneven([*WALLS, *FURNITURE])
    return Place(drawn([*known, *unmapped], WIDTH, DEPTH), mapped(drawn(known, WIDTH, DEPTH)))


def twin_rooms() -> Place:
    """Two rooms of the same shape with the same furniture, side by side."""
    rooms = [*TWIN_FURNITURE, *((a + 5.05, b, c + 5.05, d) for a, b, c, d in TWIN_FURNITURE)]
    solid = drawn([*TWIN_WALLS, *rooms], 10.2, 6.0)
    return Place(solid, mapped(solid))


class Drifting:
    """Dead reckoning with 1 % scale error, 2 % slip and a slow rotation drift."""

    def __init__(self, generator: np.random.Generator) -> None:
        self.generator = generator
        self.pose = Pose2D(generator.normal(), generator.normal(), generator.uniform(-pi, pi))
        self.scale = 1.0 + generator.normal(0.0, 0.01)
        self.turn_rate = generator.normal(0.0, 0.002)

    def move(self, by: Pose2D, elapsed: float) -> Pose2D:
        """Return the pose in the odom frame after a small true displacement."""
        slip = 1.0 + self.generator.normal(0.0, 0.02)
        self.pose = self.pose.compose(
            Pose2D(
                by.x * self.scale * slip,
                by.y,
                by.heading * (1.0 + self.generator.normal(0.0, 0.005)) + self.turn_rate * elapsed,
            )
        )
        return self.pose


def along(waypoints: list[tuple[float, float]], start_heading: float, speed: float, period: float):
    """True displacements per period of a robot that turns in place and drives straight."""
    pose = Pose2D(*waypoints[0], start_heading)
    for x, y in waypoints[1:]:
        target = Pose2D(x, y)
        while pose.distance_to(target) > speed * period:
            off = (pose.bearing_to(target) - pose.heading + pi) % (2 * pi) - pi
            turn = float(np.clip(off, -1.0 * period, 1.0 * period))
            step = Pose2D(speed * period if abs(off) < 0.2 else 0.0, 0.0, turn)
            pose = pose.compose(step)
            yield pose, step
