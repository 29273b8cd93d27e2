"""Poses, twists, paths and footprints. Metres, radians; x forward, y left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def wrap_angle(angle: float) -> float:
    """The same angle in (-pi, pi]."""
    wrapped = (angle + pi) % (2.0 * pi) - pi
    return pi if wrapped == -pi else wrapped


def unwrapped(angles: Sequence[float]) -> FloatArray:
    """Return (n,) angles without jumps of a whole turn; at most half a turn between neighbours."""
    found = np.array(angles)
    # np.unwrap takes tens of microseconds
    return np.unwrap(found) if max(angles) - min(angles) > pi else found


@dataclass(frozen=True, slots=True)
class Pose2D:
    """A position and heading in the plane.

    Attributes:
        x: metres along the frame's x axis.
        y: metres along the frame's y axis.
        heading: radians, anticlockwise from the frame's x axis.
    """

    x: float
    y: float
    heading: float = 0.0

    def distance_to(self, other: Pose2D) -> float:
        """Straight-line distance between the two positions, in metres."""
        return hypot(other.x - self.x, other.y - self.y)

    def bearing_to(self, other: Pose2D) -> float:
        """Direction from this position to the other, radians in the frame of both."""
        return atan2(other.y - self.y, other.x - self.x)

    def compose(self, local: Pose2D) -> Pose2D:
        """Transform `local` from this pose's frame to the frame that this pose is expressed in."""
        c, s = cos(self.heading), sin(self.heading)
        return Pose2D(
            self.x + c * local.x - s * local.y,
            self.y + s * local.x + c * local.y,
            wrap_angle(self.heading + local.heading),
        )

    def inverse(self) -> Pose2D:
        """The inverse transform: composed with this pose it is the identity."""
        c, s = cos(self.heading), sin(self.heading)
        return Pose2D(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.heading))

    def relative_to(self, base: Pose2D) -> Pose2D:
        """This pose in the frame of `base`: base.compose(result) is this pose."""
        c, s = cos(base.heading), sin(base.heading)
        heading = wrap_angle(-base.heading)
        x, y = -c * base.x - s * base.y, s * base.x - c * base.y
        c, s = cos(heading), sin(heading)
        return Pose2D(
            x + c * self.x - s * self.y, y + s * self.x + c * self.y,
            wrap_angle(heading + self.heading),
        )  # fmt: skip

    def transform(self, points: FloatArray) -> FloatArray:
        """Transform points (n, 2) from this pose's frame to the frame it is expressed in."""
        c, s = cos(self.heading), sin(self.heading)
        turned: FloatArray = points.dot(np.array([[c, s], [-s, c]]))
        x, y = turned[:, 0], turned[:, 1]  # views: adding a pair to all rows takes twice as long
        x += self.x
        y += self.y
        return turned


def on_floor(transform: FloatArray) -> Pose2D:
    """Return position and heading of a transform (4, 4), without its height and tilt."""
    heading = atan2(transform[1, 0], transform[0, 0])
    return Pose2D(float(transform[0, 3]), float(transform[1, 3]), heading)


STANDING_SPEED, STANDING_TURN = 0.02, 0.05
"""m/s and rad/s below which a robot stands: what the wheels of one at rest may measure."""


@dataclass(frozen=True, slots=True)
class Twist:
    """Velocity in the base frame: metres per second forward and to the left, radians per second."""

    linear: float = 0.0
    angular: float = 0.0
    lateral: float = 0.0

    @property
    def stands(self) -> bool:
        """Whether a robot with this measured velocity stands."""
        speed = hypot(self.linear, self.lateral)
        return speed < STANDING_SPEED and abs(self.angular) < STANDING_TURN

    def share_of(self, wanted: Twist) -> float:
        """Return the share that this velocity is of a wanted one of the same arc; 1 of none."""
        most = hypot(wanted.linear, wanted.lateral, wanted.angular)
        return hypot(self.linear, self.lateral, self.angular) / most if most > 0.0 else 1.0


STANDSTILL = Twist()


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """A path: poses in driving order, in the map frame. Two paths are equal if they are the same.

    Attributes:
        points: (n, 3) float64: x, y in metres and heading in radians; start first.
        speed_limits: (n,) m/s, speed limit from each point to the next; inf: only the robot's own
            limit. None without any limit.
        partial: the path ends at the nearest reachable pose, farther from the goal than the
            planner's tolerance.
    """

    points: FloatArray
    speed_limits: FloatArray | None = None
    partial: bool = False

    @property
    def length(self) -> float:
        """Length along the path, in metres."""
        return float(np.linalg.norm(np.diff(self.points[:, :2], axis=0), axis=1).sum())

    def __str__(self) -> str:
        """Return the length and the number of poses, for people."""
        return f"path of {self.length:.1f} m, {len(self.points)} poses"

    @property
    def goal(self) -> Pose2D:
        """The last pose."""
        x, y, heading = self.points[-1]
        return Pose2D(float(x), float(y), float(heading))


ROUND_CORNERS = 16
"""Number of corners of a round footprint."""


@dataclass(frozen=True)
class Footprint:
    """Outline of the robot on the floor, in the base frame.

    Attributes:
        points: (n, 2) corners in metres, anticlockwise, n >= 3. A round robot is a 16-gon.
    """

    points: FloatArray

    @staticmethod
    def circle(radius: float) -> Footprint:
        """A regular 16-gon that contains the circle of this radius."""
        angles = np.arange(ROUND_CORNERS) * (2.0 * pi / ROUND_CORNERS)
        outer = radius / cos(pi / ROUND_CORNERS)
        return Footprint(outer * np.column_stack([np.cos(angles), np.sin(angles)]))

    @property
    def is_round(self) -> bool:
        """Whether it is that of `circle`, or rounder: it touches nothing by turning in place."""
        return self.inscribed_radius >= (cos(pi / ROUND_CORNERS) - 1e-9) * self.circumscribed_radius

    @property
    def is_compact(self) -> bool:
        """Whether a disc about the base describes it: at most one and a half times as long as wide.

        A rectangle of these sides with the base in its middle has sqrt(1 + 1.5²) = 1.80 as the
        ratio of its radii; with the base off its middle it has more.
        """
        return self.circumscribed_radius <= 1.81 * self.inscribed_radius

    @property
    def width(self) -> float:
        """Narrowest gap through which it passes straight: the least width over all directions, m.

        That of its convex hull, at right angles to one of the hull's edges (Houle and Toussaint,
        "Computing the width of a set", PAMI 1988).
        """
        offsets = self.points[:, None] - self.points[None, :]
        lengths = np.hypot(offsets[..., 0], offsets[..., 1])
        edges = offsets[lengths > 1e-9] / lengths[lengths > 1e-9][:, None]
        across = self.points @ np.column_stack([-edges[:, 1], edges[:, 0]]).T
        return float((across.max(axis=0) - across.min(axis=0)).min())

    @property
    def half_width(self) -> float:
        """Half the width, metres; the inscribed radius where that is as large, to the last bit."""
        return max(self.inscribed_radius, 0.5 * self.width - 1e-9)

    @property
    def front(self) -> float:
        """Distance from the base to the foremost corner, in metres."""
        return float(self.points[:, 0].max())

    @cached_property
    def inscribed_radius(self) -> float:
        """Distance from the base to the nearest edge, in metres."""
        starts, ends = self.points, np.roll(self.points, -1, axis=0)
        edges = ends - starts
        t = -np.einsum("ij,ij->i", starts, edges) / np.einsum("ij,ij->i", edges, edges)
        nearest = starts + np.clip(t, 0.0, 1.0)[:, None] * edges
        return float(np.linalg.norm(nearest, axis=1).min())

    @cached_property
    def circumscribed_radius(self) -> float:
        """Distance from the base to the farthest corner, in metres."""
        return float(np.linalg.norm(self.points, axis=1).max())
