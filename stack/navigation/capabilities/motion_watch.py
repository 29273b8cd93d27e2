"""Watch on the way of an arm that moves: depth cameras see what nobody knew when it was planned.

Each picture is compared, in the planner's thread, with the rest of the way. The arm stands as long
as something new is near it, and goes on when two pictures show the way free.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from stack.drivetrain.arm_description import ArmDescription
from stack.errors import FrameError
from stack.frames.joint_history import JointHistory
from stack.manipulation.measured import ArmPicture
from stack.manipulation.scene import Scene
from stack.navigation.capabilities.gripper import GRIPPER
from stack.navigation.plans.arm_plans import ArmPlans, Way
from stack.navigation.plans.deferred import Deferred
from stack.perception.camera_lease import CameraLease
from stack.types import (
    DepthImage,
    Failure,
    FloatArray,
    GripperState,
    JointState,
    JointTrajectory,
    Perceived,
)

JOINTS = "joints"
"""Name of the measurement."""

FRESH = 0.5
"""Seconds: age of the pictures for a plan. It waits so long for cameras that have been off."""

REMEMBERED = 1.0
"""Seconds for which positions of the joints are kept, for the stamps of pictures."""

FREE = 2
"""Pictures that show the way free before the arm goes on."""


class MotionWatch:
    """Collects pictures for plans, and watches the motion that goes on.

    Args:
        cameras: the depth cameras by name, and whether the arm moves them; without any, nothing is
            watched.
        arm: description.
        places: (4, 4) base link <- base, and odom <- base link, now.
        plans: of the arm; it compares.
        lease: keeps the cameras on.

    Attributes:
        contact: what would come near to what on the way; empty: it is free.
        since: begin of the time in which the arm stands for it, seconds; None: it moves.
    """

    def __init__(
        self, cameras: Mapping[str, bool], arm: ArmDescription,
        places: Callable[[], tuple[FloatArray, FloatArray]], plans: ArmPlans, lease: CameraLease,
    ) -> None:  # fmt: skip
        self._cameras, self._plans, self._lease = cameras, plans, lease
        self._gripper, self._places = arm.gripper, places
        self._joints = JointHistory(arm.joints, REMEMBERED)
        self._pictures: dict[str, ArmPicture] = {}
        self._seen: dict[str, float] = {}
        self._answer: Deferred[str] | None = None
        self._trajectory: JointTrajectory | None = None
        self._row, self._known, self._free = 0, -np.inf, 0
        self.contact = ""
        self.since: float | None = None

    def measure(self, perceived: Perceived) -> None:
        """Take the joints and new pictures of a step; call in each."""
        joints = perceived.newest(JOINTS, JointState)
        if joints is None or not self._cameras:
            return
        self._joints.add(joints)
        for name in self._cameras:
            image = perceived.newest(name, DepthImage)
            if image is None or image.stamp == self._seen.get(name):
                continue
            self._seen[name] = image.stamp
            try:
                positions = np.array(list(self._joints.at(image.stamp).values()))
            except FrameError:  # of a time before the first joints, or too old
                continue
            fingers = perceived.newest(GRIPPER, GripperState)
            width = None if fingers is None else fingers.width
            self._pictures[name] = ArmPicture(
                image, *self._places(), positions, width, self._cameras[name]
            )

    def is_ready(self, now: float, since: float) -> bool:
        """Keep the cameras on; return whether a plan can begin: with fresh pictures, or without.

        Args:
            now: seconds.
            since: when the plan was first wanted.
        """
        if not self._cameras:
            return True
        self._lease.renew(now)
        stamps = [self._seen.get(name, -np.inf) for name in self._cameras]
        return min(stamps) > now - FRESH or now - since >= FRESH

    def take(self) -> tuple[ArmPicture, ...]:
        """Return the pictures that no plan has had yet."""
        taken = tuple(self._pictures.values())
        self._pictures.clear()
        return taken

    def begin(self, trajectory: JointTrajectory, known: float) -> None:
        """Watch a motion.

        Args:
            trajectory: from its begin.
            known: time of the newest picture when it was planned, seconds.
        """
        self.end()
        self._trajectory, self._row, self._known = trajectory, 0, known

    def end(self) -> None:
        """Watch nothing."""
        if self._answer is not None:
            self._answer.drop()
        self._answer = self._trajectory = self.since = None
        self.contact, self._free = "", 0

    def step(self, perceived: Perceived, scene: Callable[[], Scene]) -> None:
        """Compare new pictures with the rest of the way.

        Args:
            perceived: in this step.
            scene: returns what is known around the arm.
        """
        joints, now = perceived.newest(JOINTS, JointState), perceived.time
        if self._trajectory is None or joints is None or not self._cameras:
            return
        self._lease.renew(now)
        if self._answer is not None:
            found = self._answer.result(now)
            if found is None:
                return
            self._answer = None
            self._judge(found.sentence if isinstance(found, Failure) else found, now)
        if self._pictures:
            self._row = row_of(self._trajectory, joints.positions, self._row)
            way = Way(self._trajectory.positions[self._row :], self._known)
            self._answer = self._plans.compare(way, scene(), self.take(), now)

    def _judge(self, contact: str, now: float) -> None:
        if contact:
            self.contact, self._free = contact, 0
            self.since = now if self.since is None else self.since
        elif self.since is not None:
            self._free += 1
            if self._free >= FREE:
                self.contact, self.since = "", None


def row_of(trajectory: JointTrajectory, positions: FloatArray, before: int) -> int:
    """Return the row of a trajectory that is nearest to measured positions (n,).

    Args:
        trajectory: that the arm follows.
        positions: of its joints.
        before: row at an earlier time; the search ends two seconds later.
    """
    end = int(np.searchsorted(trajectory.times, trajectory.times[before] + 2.0, side="right"))
    off = np.abs(trajectory.positions[before:end] - positions).max(axis=1)
    return before + int(off.argmin())
