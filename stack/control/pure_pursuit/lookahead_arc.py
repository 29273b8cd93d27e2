"""Arcs to lookahead points, and what they lack of a path that is no arc."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, sin

from stack.geometry.path_segment import PathSegment
from stack.types import Pose2D, Twist

LEAST_SQUARE = 1e-6
"""m²: squares of smaller distances to a lookahead point are replaced by it."""


@dataclass(frozen=True, slots=True)
class LookaheadArc:
    """An arc to a lookahead point.

    Attributes:
        curvature: turning per metre, 1/m.
        bearing: of the lookahead point, base frame, radians.
        free: metres that are clear.
        cost: highest cost under the base along the arc.
        sideways: whether the robot moves straight to the point, not along its heading
            (omnidirectional).
    """

    curvature: float
    bearing: float
    free: float = 0.0
    cost: int = 0
    sideways: bool = False

    @staticmethod
    def through(pose: Pose2D, point: tuple[float, float]) -> LookaheadArc:
        """Return the arc that begins as a pose looks and leads through a point, map frame."""
        dx, dy = point[0] - pose.x, point[1] - pose.y
        c, s = cos(pose.heading), sin(pose.heading)
        forward, left = c * dx + s * dy, c * dy - s * dx
        square = max(LEAST_SQUARE, dx * dx + dy * dy)
        return LookaheadArc(2.0 * left / square, atan2(left, forward))

    def twist(self, speed: float) -> Twist:
        """Return the twist that drives the arc at a speed in m/s."""
        if not self.sideways:
            return Twist(speed, speed * self.curvature)
        c, s = cos(self.bearing), sin(self.bearing)
        return Twist(speed * c, speed * self.curvature, speed * s)


def lacking_curvature(segment: PathSegment, point: tuple[float, float], ahead: float) -> float:
    """Curvature that the arc to a lookahead point lacks where the path is no arc, 1/m.

    It is the path's own, less that of the arc from the path to the point. Without it a robot cuts
    a bend of radius R by L² / 8R, with the lookahead distance L.

    Args:
        segment: up to date with the robot's pose.
        point: lookahead point on it, map frame.
        ahead: metres that the robot drives before a command takes effect.
    """
    own = LookaheadArc.through(segment.pose_ahead(0.0), point)
    return segment.curvature_ahead(ahead) - own.curvature
