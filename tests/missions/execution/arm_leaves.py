"""Behaviours that move an arm along a fixed line in joint space, for tests without a planner."""

import numpy as np
from py_trees.common import Status

from treepilot import Behaviour, JointTrajectory, port

STEP = np.array([0.6, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0])


def line(begin, step, seconds):
    """A quintic along `step`, at rest at both ends."""
    u = np.linspace(0.0, 1.0, 41)
    share = 10 * u**3 - 15 * u**4 + 6 * u**5
    rate = (30 * u**2 - 60 * u**3 + 30 * u**4) / seconds
    rate[-1] = 0.0
    return JointTrajectory(seconds * u, begin + np.outer(share, step), np.outer(rate, step))


class SwingArm(Behaviour):
    """Move the arm by STEP."""

    claims = ("arm",)
    share: float = port("of the step", default=1.0)
    seconds: float = port("duration", unit="s", default=2.0)

    def initialise(self) -> None:
        begin = self.robot.arm.joints.positions
        self._task = self.robot.arm.follow(line(begin, self.share * STEP, self.seconds))

    def update(self) -> Status:
        return self.follow(self._task)


class SwingTwice(Behaviour):
    """Move the arm by STEP, wait, and move it on by as much: two motions of one behaviour."""

    claims = ("arm",)
    wait: float = port("between the motions", unit="s", default=2.0)

    def initialise(self) -> None:
        self._left, self._timer = 2, None
        self._swing()

    def _swing(self) -> None:
        self._left, self._timer = self._left - 1, None
        self._task = self.robot.arm.follow(line(self.robot.arm.joints.positions, STEP, 2.0))

    def update(self) -> Status:
        status = self.follow(self._task)
        if status is not Status.SUCCESS or not self._left:
            return status
        self._timer = self._timer or self.start_timer()
        if self._timer.is_over(self.wait):
            self._swing()
        return Status.RUNNING


class MoveFingers(Behaviour):
    """Move the fingers to a width."""

    claims = ("gripper",)
    width: float = port("between the fingers", unit="m")

    def initialise(self) -> None:
        self._task = self.robot.gripper.move(self.width)

    def update(self) -> Status:
        return self.follow(self._task)


class DriveAnyway(Behaviour):
    """Ask for a drive without saying that it needs one."""

    def update(self) -> Status:
        self.robot.base.spin(1.0)
        return Status.SUCCESS
