"""Evasive motions that a robot can try, as rows of `stack.control.evasion.kernels`."""

from __future__ import annotations

from math import pi

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.types import FloatArray, Twist

SPEED_SHARES = (1.0, 0.6, 0.3, -0.5, -1.0)
"""Shares of the top speed, forward and backward."""

TURN_SHARES = (-1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0)
"""Shares of the turning speed of arcs."""

ARC_TIMES = (0.7, 10.0)
"""Seconds of an arc before the robot goes on straight."""

FIRST_TURNS = (0.25 * pi, 0.5 * pi, 0.75 * pi)
"""Radians of a turn in place before the robot drives straight on, to both sides."""

DIRECTIONS = 12
"""Directions of straight motions of a robot that moves sideways."""

TURNING_SPEED = 1.5
"""Upper limit of the turning speed, rad/s."""


def motions_of(robot: RobotDescription) -> FloatArray:
    """Return (n, 7) motions: first twist, its duration, second twist. The first one stands."""
    limits, drive = robot.limits, robot.drivetrain
    turn = min(limits.angular_speed, TURNING_SPEED)
    standing = Twist()
    found = [(standing, 10.0, standing)]
    for share in SPEED_SHARES:
        speed = share * (limits.linear_speed if share > 0.0 else limits.reverse_speed)
        for turning in TURN_SHARES:
            arc = drive.feasible(Twist(speed, turning * turn))
            for seconds in ARC_TIMES if turning else ARC_TIMES[-1:]:
                found.append((arc, seconds, Twist(speed)))
    if drive.turns_in_place:
        for angle in FIRST_TURNS:
            for side in (-1.0, 1.0):
                spin = Twist(angular=side * turn)
                seconds = angle / turn + 0.5 * turn / limits.angular_acceleration
                for speed in (0.8 * limits.linear_speed, -limits.reverse_speed):
                    found.append((spin, seconds, Twist(speed)))
    if drive.can_move_sideways:
        for angle in np.linspace(0.0, 2.0 * pi, DIRECTIONS, endpoint=False):
            aside = Twist(
                limits.linear_speed * float(np.cos(angle)), 0.0,
                limits.lateral_speed * float(np.sin(angle)),
            )  # fmt: skip
            found.append((drive.feasible(limits.clipped(aside)), 10.0, standing))
    rows = [
        (a.linear, a.lateral, a.angular, seconds, b.linear, b.lateral, b.angular)
        for a, seconds, b in found
        if b == standing or drive.feasible(b) == b
    ]
    return np.unique(np.array(rows, dtype=np.float64), axis=0)
