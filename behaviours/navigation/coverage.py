"""Coverage of an area."""

from __future__ import annotations

import numpy as np
from py_trees.common import Status

from behaviours._motion.driving import SteppedBehaviour, Steps
from behaviours._motion.odometry_trail import OdometryTrail
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import Failure, FailureCode, Path, Pose2D

POSE_SPACING = 0.1
"""Metres between two poses of a lane."""


class Coverage(SteppedBehaviour):
    """Drive over all of a room or polygon in parallel lanes, as a vacuum cleaner does.

    The lanes keep the robot's clearance from obstacles on the map and from keep-out zones. A lane
    that is blocked is left out after one attempt around the obstacle. Fails with NO_VALID_PATH if
    no lane fits, for example inside a keep-out zone, and with CHECK_FAILED if less than `least` of
    the free area was covered.
    """

    area: list[Pose2D] = port(
        "corners of a polygon, map frame; default: the room in which the robot is", default=[]
    )
    width: float | None = port(
        "width of a lane; default: that of the robot", unit="m", default=None, above=0.0
    )
    overlap: float = port(
        "part of a lane that the next one covers again", default=0.2, at_least=0.0, at_most=0.9
    )
    least: float = port(
        "least share of the free area for a success", default=0.5, at_least=0.0, at_most=1.0
    )
    covered: float = output("share of the free area that was covered")
    path_length: float = output("distance driven", unit="m")
    time_taken: float = output("duration", unit="s")

    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.CHECK_FAILED)
    area_ports = ("area",)

    def initialise(self) -> None:
        self._width = self.width or 2.0 * self.robot.base.footprint.half_width
        spacing = self._width * (1.0 - self.overlap)
        self._plan = self.robot.map.coverage(list(self.area), spacing)
        self._seen = np.zeros(len(self._plan.points), dtype=bool)
        self._timer, self._trail = self.start_timer(), OdometryTrail()
        self._left_out: Failure | None = None
        self._steps = self._cover()

    def update(self) -> Status:
        self._trail.record(self.robot.time, self.robot.base.odometry)
        self._mark()
        if not self._plan.lanes:
            zones = " and ".join(repr(name) for name in self._plan.zones)
            why = f"; keep-out zones in it: {zones}" if zones else ""
            return self.fail(FailureCode.NO_VALID_PATH, f"no lane fits into the area{why}")
        share = float(self._seen.mean()) if self._seen.size else 0.0
        if self.advance(self._steps) is not Status.RUNNING:
            return self._result(share)
        self.feedback_message = f"{self._progress}, {share:.0%} covered"
        return Status.RUNNING

    def _result(self, share: float) -> Status:
        self.covered, self.failure = share, None
        self.path_length, self.time_taken = self._trail.distance, self._timer.elapsed
        if share < self.least:
            sentence = f"covered {share:.0%} of the free area, expected at least {self.least:.0%}"
            if self._left_out is not None:
                sentence += f"; the first lane that was left out: {self._left_out.sentence}"
            return self.fail(FailureCode.CHECK_FAILED, sentence)
        return Status.SUCCESS

    def _cover(self) -> Steps:
        for number, (start, end) in enumerate(self._plan.lanes, 1):
            self._progress = f"lane {number} of {len(self._plan.lanes)}"
            if not (yield from self._lane(start, end)) and self._left_out is None:
                self._left_out = self.failure
        return True

    def _lane(self, start: Pose2D, end: Pose2D) -> Steps:
        if not (yield from self.done(self.robot.base.navigate_to(start))):
            return False
        path = _straight(start, end)
        if (yield from self.done(self.robot.base.follow_path(path))):
            return True
        return (yield from self.done(self.robot.base.navigate_to(end)))

    def _mark(self) -> None:
        """Mark the points under the robot as covered."""
        pose, half = self.robot.localisation.pose, 0.5 * self._width
        away = np.hypot(self._plan.points[:, 0] - pose.x, self._plan.points[:, 1] - pose.y)
        self._seen |= away <= half


def _straight(start: Pose2D, end: Pose2D) -> Path:
    """Return the path along a lane."""
    count = max(2, round(start.distance_to(end) / POSE_SPACING) + 1)
    shares = np.linspace(0.0, 1.0, count)
    x = start.x + shares * (end.x - start.x)
    y = start.y + shares * (end.y - start.y)
    heading = np.full(count, start.bearing_to(end))
    return Path(np.column_stack([x, y, heading]))
