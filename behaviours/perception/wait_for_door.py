"""Waiting for a door to open."""

from __future__ import annotations

from math import cos, sin

from py_trees.common import Status

from behaviours._motion.driving import DrivingBehaviour
from behaviours._sensing.doorway import Doorway
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import FailureCode, Pose2D

SIDE_CLEARANCE = 0.05
"""Metres on each side of the robot that a way must have in addition."""


class WaitForDoor(DrivingBehaviour):
    """Wait until the way through a door is free, as the lidar sees it.

    With `distance`, the robot first drives to that distance in front of the door, facing it;
    without, it waits where it is. The way is free when the beams between the jambs reach past the
    door over the robot's width, for `settle`. Fails with DOOR_CLOSED after `patience`.
    """

    door: Pose2D = port("middle of the doorway, map frame; the heading leads through it")
    width: float = port("between the jambs", unit="m", default=0.9, at_least=0.3, at_most=10.0)
    least_width: float | None = port(
        "free width that is enough; default: the robot's with 5 cm on each side", unit="m",
        default=None, above=0.0,
    )  # fmt: skip
    beyond: float = port(
        "free depth behind the door", unit="m", default=0.4, at_least=0.05, at_most=5.0
    )
    distance: float | None = port(
        "from the door to the robot's front while it waits; default: where it is", unit="m",
        default=None, at_least=0.3, at_most=5.0,
    )  # fmt: skip
    patience: float = port("time limit of the wait", unit="s", default=60.0, above=0.0)
    settle: float = port("time for which the way must be free", unit="s", default=1.0, at_least=0.0)
    waited: float = output("time of the wait", unit="s")
    free_width: float = output("width of the free part of the doorway", unit="m")

    needs = ("lidar",)
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.DOOR_CLOSED)

    def initialise(self) -> None:
        self._doorway = Doorway(self.door, self.width)
        self._drive = None
        if self.distance is not None:
            self._drive = self.robot.base.navigate_to(self._waiting_place(self.distance))
        self._waiting, self._free = self.start_timer(), self.start_timer()
        self._newest, self._is_seen = -1.0, False
        self.free_width, self.waited = 0.0, 0.0

    def update(self) -> Status:
        if self._drive is not None:
            status = self.follow(self._drive)
            if status is not Status.SUCCESS:
                return status
            self._drive, self._followed = None, None
            self._waiting.restart()
            self._free.restart()
        self.stand(gives_way=True)
        self._look()
        self.waited = self._waiting.elapsed
        if self._is_free and self._free.is_over(self.settle):
            self.feedback_message = f"free, {self.free_width:.2f} m"
            return Status.SUCCESS
        if self._waiting.is_over(self.patience):
            return self.fail(
                FailureCode.DOOR_CLOSED, f"{self._state} after {self.patience:g} s of waiting"
            )
        self.feedback_message = f"{self._state}, {self._waiting.left(self.patience):.0f} s left"
        return Status.RUNNING

    def _look(self) -> None:
        scan = self.robot.perception.scan
        if scan is None or scan.stamp <= self._newest:
            return
        self._newest = scan.stamp
        free = self._doorway.free_width(scan, self.robot.localisation.pose, self.beyond)
        self._is_seen = free is not None
        self.free_width = free or 0.0
        if not self._is_free:
            self._free.restart()

    @property
    def _is_free(self) -> bool:
        return self._is_seen and self.free_width >= self._needed

    @property
    def _needed(self) -> float:
        if self.least_width is not None:
            return self.least_width
        return 2.0 * (self.robot.base.footprint.inscribed_radius + SIDE_CLEARANCE)

    @property
    def _state(self) -> str:
        if not self._is_seen:
            return (
                f"the doorway at ({self.door.x:.1f}, {self.door.y:.1f}) is not in the lidar's view"
            )
        free, needed = self.free_width, self._needed
        return f"{free:.2f} m of {self.width:g} m are free, {needed:.2f} m are needed"

    def _waiting_place(self, distance: float) -> Pose2D:
        """Return the pose in front of the door, on the robot's side of it, facing it."""
        door, here = self.door, self.robot.localisation.pose
        away = distance + self.robot.base.footprint.front
        side = -1.0 if here.relative_to(door).x <= 0.0 else 1.0
        x = door.x + side * away * cos(door.heading)
        y = door.y + side * away * sin(door.heading)
        return Pose2D(x, y, Pose2D(x, y).bearing_to(door))
