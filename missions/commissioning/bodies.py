"""The body of the robot that is commissioned."""

from __future__ import annotations

from robots.bodies import BodySetup, chosen_body
from stack.body import Body
from stack.drivetrain.description import RobotDescription
from stack.sim.worlds.world import World
from stack.types import Pose2D


def open_body(
    robot: RobotDescription, world: World, start: Pose2D, *, choice: str = "", seed: int = 0
) -> Body:
    """Connect to a robot, or simulate it as fast as possible.

    Args:
        robot: its description.
        world: in which a simulated robot drives.
        start: pose of a simulated robot, world frame.
        choice: name of the body; empty: that of the robot file.
        seed: of a simulated robot.

    Raises:
        InputError: there is no body of this name.
        BodyError: the robot cannot be reached.
    """
    return chosen_body(robot, choice)(BodySetup(robot, world, start, seed))
