"""The finest tolerance at a goal that a robot can meet."""

from __future__ import annotations

from math import radians

from stack.components import GoalTolerance
from stack.control.goal_alignment import CREEP
from stack.control.turning import SLOWEST
from stack.drivetrain.description import RobotDescription

POSE_SHARE = 0.3
"""Deviation of the estimated position, divided by the noise of a lidar's ranges.

Measured: 3 mm in simulation, with 1 cm of noise.
"""

CAR = GoalTolerance(0.03, radians(3.0))
"""What a car leaves at the end of a planned path: it cannot correct an error beside the path there.

An estimate: drives in the tests of cars end within it.
"""


def finest_tolerance(robot: RobotDescription, period: float) -> GoalTolerance:
    """Return the finest tolerances that a robot can be expected to meet.

    It stops somewhere in one control period at its lowest speed, and knows its position only as
    exactly as it is estimated.

    Args:
        robot: its kind of drive and its lidars.
        period: seconds between two commands.
    """
    noise = min((lidar.noise for lidar in robot.all_lidars.values()), default=0.0)
    position, heading = CREEP * period + POSE_SHARE * noise, SLOWEST * period
    if robot.drivetrain.turns_in_place:
        return GoalTolerance(position, heading)
    return GoalTolerance(max(position, CAR.position), max(heading, CAR.heading))
