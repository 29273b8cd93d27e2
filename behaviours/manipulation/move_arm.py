"""Moving an arm to a posture, to positions of its joints, or its tool to a pose."""

from __future__ import annotations

import numpy as np
from py_trees.common import Status

from behaviours._arm.acting import MOTION_FAILURES
from behaviours._arm.poses import ToolPose
from behaviours.base import RobotBehaviour, port
from stack.errors import ParameterError
from stack.robot import Task


class MoveArm(RobotBehaviour):
    """Move the arm to a posture, to positions of its joints, or its tool to a pose.

    The motion is planned without contact with the boxes of the world and the blocks that were
    detected. It fails with UNREACHABLE, NO_MOTION_PLAN or GOAL_OCCUPIED before it begins, and with
    ARM_COLLISION if something stops the arm.
    """

    posture: str | None = port("posture of the robot file, such as home", default=None)
    joints: list[float] | None = port(
        "position of each joint, from the base to the hand", unit="rad", default=None
    )
    pose: ToolPose | None = port("pose of the tool in the arm's base link", default=None)
    straight: bool = port("move the tool to the pose along a straight line", default=False)
    speed: float = port("share of the top speed", default=1.0, above=0.0, at_most=1.0)

    claims = ("arm",)
    fails_with = MOTION_FAILURES
    one_port_of = ("posture", "joints", "pose")
    joints_port = "joints"
    posture_port = "posture"
    also_known_as = ("MoveToPose", "PlanAndExecute")

    def initialise(self) -> None:
        self._task = self._asked()

    def update(self) -> Status:
        return self.follow(self._task)

    def _asked(self) -> Task:
        arm, goals = self.robot.arm, (self.posture, self.joints, self.pose)
        if sum(goal is not None for goal in goals) != 1:
            raise ParameterError("", "move_arm needs exactly one of posture, joints and pose")
        if self.posture is not None:
            return arm.move_to_posture(self.posture, speed=self.speed)
        if self.joints is not None:
            return arm.move_joints(np.array(self.joints), speed=self.speed)
        assert self.pose is not None
        return arm.move_tool(self.pose.matrix(), straight=self.straight, speed=self.speed)
