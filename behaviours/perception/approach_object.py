"""Drive up to an object of a colour, or of a label of the object detector."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin

from py_trees.common import Status

from behaviours._motion.driving import TIME_TO_LIVE, DrivingBehaviour, Steps
from behaviours._motion.following import STUCK_TIME, StuckWatch
from behaviours._sensing.object_watch import SAME_PLACE, ObjectWatch, SeenObject, WantedObject
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import (
    OBJECT_COLOURS,
    FailureCode,
    Pose2D,
    TaskStatus,
    Twist,
    wrap_angle,
)

FIRST_DETECTION_TIME = 3.5
"""Seconds for the first detection; a silent camera is noticed before."""

STAGING_DISTANCE = 0.5
"""Metres between the robot's front and the object before the final approach, at least."""

BEARINGS = (0.0, 0.6, -0.6, 1.2, -1.2, 2.0, -2.0, pi)
"""Radians; sides of the object, against the robot's, that are tried in turn."""

REPLAN_DISTANCE = 0.3
"""Metres that the object moves before the drive to it starts again."""

TURN_GAIN, FASTEST_TURN, AHEAD = 1.5, 0.8, 0.3
"""1/s, rad/s, and radians of the bearing within which the robot drives forward."""

SLOWER, SLOWEST = 0.8, 0.03
"""1/s, speed per distance to go, and m/s."""

CLOSE_ENOUGH, POINTED = 0.01, 0.05
"""Metres and radians."""


class ApproachObject(DrivingBehaviour):
    """Drive up to an object of a colour or label until the front is at a distance from it.

    Drives in front of the object by navigation, round it if there is no room on this side, then
    straight to it under the camera's control. Fails with OBJECT_NOT_FOUND if no picture shows the
    object, with NO_IMAGE if the camera stops, and with NO_PROGRESS if the robot is stuck.
    """

    colour: str | None = port("colour of the object", default=None, one_of=OBJECT_COLOURS)
    label: str | None = port(
        "instead of a colour: what it is, a label of the object detector", default=None
    )
    object: Pose2D | None = port(
        "where it was found, map frame; default: the nearest one in view", default=None
    )
    distance: float = port(
        "of the robot's front from the object at the end", unit="m", default=0.3, at_least=0.05,
        at_most=3.0,
    )  # fmt: skip
    speed: float = port(
        "speed of the final approach", unit="m/s", default=0.2, above=0.0, at_most=1.0
    )
    gap: float = output("measured distance at the end", unit="m")
    bearing: float = output("direction of the object at the end, base frame", unit="rad")

    needs = ("camera",)
    label_port = "label"
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.OBJECT_NOT_FOUND, FailureCode.NO_IMAGE)

    def initialise(self) -> None:
        """Prepare the drive; it begins with the first tick."""
        self._front = self.robot.base.footprint.front
        self._wanted = WantedObject(self.colour, self.label)
        self._watch = ObjectWatch(self.robot, self._wanted, self.start_timer())
        self._target = self.object
        self._is_seen = False
        self._steps = self._approach()

    def update(self) -> Status:
        self._look(self._watch.update())
        if self._watch.is_blind:
            return self.fail(FailureCode.NO_IMAGE, self._wanted.silence)
        return self.advance(self._steps)

    def _look(self, seen: list[SeenObject]) -> None:
        """Take the object that is nearest to the target; the first one is nearest to the robot."""
        if not seen:
            return
        best = seen[0]
        if self._target is not None:
            x, y = self._target.x, self._target.y
            best = min(seen, key=lambda item: hypot(item.x - x, item.y - y))
            far = hypot(best.x - x, best.y - y)
            if far > 2.0 * SAME_PLACE + 3.0 * best.deviation:
                return
        self._target, self._is_seen = Pose2D(best.x, best.y), True

    def _approach(self) -> Steps:
        if self._target is None and not (yield from self._wait_for_sight()):
            return False
        if not (yield from self._stage()):
            return False
        if not self._is_seen and not (yield from self._wait_for_sight()):
            return False
        return (yield from self._close_in())

    def _wait_for_sight(self) -> Steps:
        timer = self.start_timer()
        while not self._is_seen:
            if timer.is_over(FIRST_DETECTION_TIME):
                self.fail(FailureCode.OBJECT_NOT_FOUND, f"no {self._wanted} in view")
                return False
            self.feedback_message = f"looking for the {self._wanted}"
            self.stand()
            yield
        return True

    def _stage(self) -> Steps:
        """Drive in front of the object; the nearest side first."""
        away = self._front + max(self.distance, STAGING_DISTANCE)
        for bearing in BEARINGS:
            while True:
                planned = self._known_target
                task = self.robot.base.navigate_to(
                    _beside(planned, self.robot.localisation.pose, bearing, away)
                )
                while self.follow(task) is Status.RUNNING:
                    self.feedback_message = f"driving to the {self._wanted}"
                    yield
                    if self._known_target.distance_to(planned) > REPLAN_DISTANCE:
                        break
                else:
                    break
            if task.status is TaskStatus.SUCCEEDED:
                self.failure = None
                return True
            if self.failure is not None and self.failure.code == FailureCode.LOST:
                return False
        return False

    def _close_in(self) -> Steps:
        """Turn to the object and drive up to it."""
        watch = StuckWatch(self.start_timer(), self.robot.base.odometry)
        while True:
            target = self._known_target.relative_to(self.robot.localisation.pose)
            bearing = atan2(target.y, target.x)
            to_go = hypot(target.x, target.y) - self._front - self.distance
            self.gap, self.bearing = to_go + self.distance, bearing
            if to_go <= CLOSE_ENOUGH and abs(bearing) <= POINTED:
                self.stand()
                return True
            if watch.is_stuck(self.robot.base.odometry):
                self.fail(FailureCode.NO_PROGRESS, f"no progress for {STUCK_TIME:g} s")
                return False
            self.feedback_message = f"{100 * max(to_go, 0.0):.0f} cm to the {self._wanted}"
            turn = min(max(TURN_GAIN * bearing, -FASTEST_TURN), FASTEST_TURN)
            linear = 0.0
            if to_go > CLOSE_ENOUGH and abs(bearing) < AHEAD:
                linear = min(self.speed, max(SLOWEST, SLOWER * to_go))
            self.robot.base.drive_for(Twist(linear, turn), TIME_TO_LIVE)
            yield

    @property
    def _known_target(self) -> Pose2D:
        assert self._target is not None
        return self._target


def _beside(target: Pose2D, robot: Pose2D, bearing: float, away: float) -> Pose2D:
    """Return the pose that faces a target from a side of it.

    Args:
        target: map frame.
        robot: map frame.
        bearing: of the side, seen from the target, against that of the robot, radians.
        away: distance from the target, metres.
    """
    side = atan2(robot.y - target.y, robot.x - target.x) + bearing
    return Pose2D(target.x + away * cos(side), target.y + away * sin(side), wrap_angle(side + pi))
