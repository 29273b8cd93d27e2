"""Backing out: a robot leaves the way of a person in front of it without turning round first."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, pi

import numpy as np

from stack.geometry.path_progress import turned
from stack.navigation.drive_tools import DriveTools
from stack.navigation.people.passing_place import LEAST_BODY, PASSING_ROOM
from stack.types import FloatArray, Footprint, Path, Perceived, Pose2D

LOOKAHEAD = 0.5
"""Metres along a path to the point whose direction decides whether it leads backward."""

BACKWARD_ANGLE = 0.6 * pi
"""Angle in radians to that point from which a path leads backward."""

FACED = 1.2
"""Metres to the centre of a person in front who may reach the robot before it has turned round."""

LEFT_BEHIND = 2.5
"""Metres to the centre of the nearest person from which on a robot that backs out may turn."""

SHORT = 2.0
"""Length of a way, metres, up to which a slow reverse takes no longer than two turns in place."""

TURNING_ROOM = 0.03
"""Metres around its circumscribed circle that a robot needs to turn in place."""


def can_turn(points: FloatArray, outline: Footprint) -> bool:
    """Whether nothing is within the circle in which a robot turns.

    Args:
        points: (n, 2) of obstacles, base frame, metres.
        outline: of the robot.
    """
    reach = outline.circumscribed_radius + TURNING_ROOM
    return not len(points) or float(np.hypot(points[:, 0], points[:, 1]).min()) > reach


def backed_out(path: Path, perceived: Perceived, tools: DriveTools) -> Path:
    """Return the path as the robot should drive it: backward if that is the better way out.

    It backs out if the path leads backward and there is no room to turn, or a person is close in
    front who would touch a robot that turns: the place is narrow, or the way so short that a slow
    reverse takes no longer. A sensor must cover the ground behind, unless there is no room to turn.

    Args:
        path: away from a person, map frame.
        perceived: in this step.
        tools: of the drive.
    """
    pose, points = perceived.estimate.pose, perceived.obstacles.points
    outline = tools.robot.footprint
    if not tools.path_follower.reverses or not _leads_backward(path, pose):
        return path
    if can_turn(points, outline):
        faced = any(_faces(pose, track.position) for track in perceived.world.tracks)
        hindered = faced and (
            path.length <= SHORT or _is_narrow(points, outline.circumscribed_radius)
        )
        if not hindered or perceived.obstacles.is_blind(pi):
            return path
    return replace(turned(path), speed_limits=path.speed_limits, partial=path.partial)


def should_turn(remaining: float, perceived: Perceived, tools: DriveTools) -> bool:
    """Whether a robot that backs out should turn round: nobody is near, and the way is long.

    Args:
        remaining: way, metres.
        perceived: in this step.
        tools: of the drive.
    """
    if remaining <= SHORT or not can_turn(perceived.obstacles.points, tools.robot.footprint):
        return False
    x, y = perceived.estimate.pose.x, perceived.estimate.pose.y
    places = (track.position for track in perceived.world.tracks)
    return all(hypot(at[0] - x, at[1] - y) > LEFT_BEHIND for at in places)


def _is_narrow(points: FloatArray, circumscribed: float) -> bool:
    """Whether a person does not fit beside a robot that turns, between what is on both sides."""
    beside = points[np.abs(points[:, 0]) <= circumscribed, 1]
    left, right = beside[beside > 0.0], -beside[beside < 0.0]
    if not (len(left) and len(right)):
        return False
    return float(left.min() + right.min()) < 2.0 * (circumscribed + LEAST_BODY) + PASSING_ROOM


def _leads_backward(path: Path, pose: Pose2D) -> bool:
    away = np.hypot(path.points[:, 0] - pose.x, path.points[:, 1] - pose.y)
    x, y, _ = path.points[int(np.argmax(away >= LOOKAHEAD)) if away.max() >= LOOKAHEAD else -1]
    return _angle(pose, (float(x), float(y))) >= BACKWARD_ANGLE


def _faces(pose: Pose2D, at: tuple[float, float]) -> bool:
    return hypot(at[0] - pose.x, at[1] - pose.y) <= FACED and _angle(pose, at) <= pi / 2.0


def _angle(pose: Pose2D, at: tuple[float, float]) -> float:
    """Angle between the heading of a pose and the direction to a point, radians, 0 to pi."""
    x, y = pose.inverse().transform(np.array([at]))[0]
    return float(abs(np.arctan2(y, x)))
