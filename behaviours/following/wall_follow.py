"""Wall following."""

from __future__ import annotations

from math import atan2, copysign, cos, hypot, pi, sin

import numpy as np
from py_trees.common import Status

from behaviours._motion.driving import TIME_TO_LIVE
from behaviours._motion.following import FollowingBehaviour
from behaviours._sensing import wall_geometry as geometry
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import FailureCode, FloatArray, Twist, wrap_angle

LOOKAHEAD = 0.45
"""Metres along the curve; 1.3 s at 0.35 m/s, well above the delay of scan and actuators (0.2 s)."""
STRAIGHT_TURN = 0.17
"""Radians; a curve that turns less than this in its first 0.6 m is straight (10 degrees)."""
SETTLING_DISTANCE = 1.0
"""Metres of straight wall before the distance error is recorded."""
FASTEST_TURN, SLOWEST_TURN = 1.2, 0.5
SPARE_ROOM, SPARE_ROOM_BACK, TURNED_BACK = 0.06, 0.02, 1.5
"""Metres of clearance below which a passage is not entered: normally, and on the way out of a dead
end, which is the first TURNED_BACK metres after turning back."""
LOOP_LENGTH, LOOP_DISTANCE, LOOP_TURN = 3.0, 0.4, pi / 3.0
BLIND_TIME = 2.0


class WallFollow(FollowingBehaviour):
    """Drive along a wall at a set distance, around corners and past doorways.

    Approaches the wall first if necessary. Succeeds at the first `until_…` that is reached; without
    any, it follows the wall until it is halted. Fails with NO_WALL if there is no wall within
    `search`, and with NO_PROGRESS if the robot is stuck.
    """

    side: str = port("side of the wall", default="left", one_of=("left", "right"))
    distance: float = port(
        "distance from the wall to the robot's centre", unit="m", default=0.5, above=0.0
    )
    speed: float = port(
        "speed on a straight wall", unit="m/s", default=0.35, above=0.0, at_most=2.0
    )
    gap: float = port("doorways up to this width are passed", unit="m", default=1.2, at_least=0.0)
    search: float = port(
        "longest distance to drive to find a wall", unit="m", default=5.0, above=0.0
    )
    until_loop: bool = port("end when the robot is back at the start of the wall", default=False)
    travelled: float = output("distance along the wall", unit="m")
    distance_error_rms: float = output("RMS distance error on straight walls", unit="m")

    needs = ("lidar",)
    claims = ("base",)
    fails_with = (*DRIVE_FAILURES, FailureCode.NO_WALL)
    ends_by = ("until_travelled", "until_time", "until_place", "until_loop")

    def initialise(self) -> None:
        super().initialise()
        self._radius = self.robot.base.footprint.circumscribed_radius
        self._since_seen = self.start_timer()
        self._course = self.robot.base.odometry.heading
        self._bent_at = 0.0
        self._turned_back_at = -TURNED_BACK

    def update(self) -> Status:
        self.record_way()
        self.travelled, self.distance_error_rms = self.way_followed, self._errors.value
        if self.distance <= self._radius:
            return self.fail(
                FailureCode.FAILED,
                f"distance {self.distance:g} m leaves no room for the robot, whose corners are "
                f"{self._radius:.2f} m from its centre; set a larger distance",
            )
        if self._is_over():
            return Status.SUCCESS
        if self.is_stuck:
            return self.no_progress()
        if self._start is None and self._trail.distance > self.search:
            return self.fail(FailureCode.NO_WALL, f"no wall found within {self.search:g} m")
        points = self._points()
        if points is None:
            return self._wait_for_scan()
        self._since_seen.restart()
        self.robot.base.drive_for(self._command(points), TIME_TO_LIVE)
        return Status.RUNNING

    def _points(self) -> FloatArray | None:
        """Return the newest scan's points, (n, 2) metres, in the current base frame."""
        scan = self.robot.perception.scan
        if scan is None or self.robot.time - scan.stamp > BLIND_TIME:
            return None
        return self._trail.since(scan.stamp).inverse().transform(scan.points())

    def _wait_for_scan(self) -> Status:
        self.stand()
        if self._since_seen.is_over(BLIND_TIME):
            return self.fail(FailureCode.NO_WALL, f"no lidar scan for {BLIND_TIME:g} s")
        self.feedback_message = "waiting for the lidar"
        return Status.RUNNING

    def _command(self, points: FloatArray) -> Twist:
        curve = self._curve(geometry.contour_of(points, self.gap))
        ahead = geometry.room_ahead(points, self._radius + 0.02) - self._radius
        if curve is None:
            self.feedback_message = "looking for a wall"
            return Twist(_limit_speed(self.speed, ahead))
        self._record_progress(curve)
        x, y = curve.points[min(round(LOOKAHEAD / geometry.CURVE_STEP), len(curve.points) - 1)]
        return _pursue(float(x), float(y), self.speed, ahead)

    def _curve(self, contour: FloatArray) -> geometry.OffsetCurve | None:
        """Return the curve ahead. After turning back in a dead end, less clearance is allowed."""
        turn = wrap_angle(self._course - self.robot.base.odometry.heading)
        tangent = np.array([cos(turn), sin(turn)])
        turned_back = self._trail.distance - self._turned_back_at < TURNED_BACK
        spare = SPARE_ROOM_BACK if turned_back else SPARE_ROOM
        side = 1 if self.side == "left" else -1
        closest = min(self._radius + spare, self.distance)
        course = geometry.WallCourse(side, self.distance, closest)
        curve = geometry.offset_curve(contour, course, tangent)
        if curve is None:
            return None
        direction = _direction_at(curve.points, LOOKAHEAD)
        if direction @ tangent < -0.5:
            self._turned_back_at = self._trail.distance
        else:
            direction = curve.tangent
        heading = self.robot.base.odometry.heading + atan2(direction[1], direction[0])
        self._course = wrap_angle(heading)
        return curve

    def _record_progress(self, curve: geometry.OffsetCurve) -> None:
        """Record the start of wall following, and the distance errors on straight walls."""
        off_course = abs(atan2(curve.tangent[1], curve.tangent[0]))
        distance = self._trail.distance
        if self._start is None and abs(curve.error) < 0.1 and off_course < 0.35:
            self.begin_here()
        if self._start is None or _bend(curve.points) > STRAIGHT_TURN:
            self._bent_at = distance
        elif distance - self._bent_at > SETTLING_DISTANCE:
            self._errors.add(curve.error)
        self.feedback_message = f"{curve.wall_distance:.2f} m from the wall"

    def _is_over(self) -> bool:
        start, here = self._start, self.robot.localisation.pose
        if start is None:
            return False
        back = here.distance_to(start.pose) <= LOOP_DISTANCE and (
            abs(wrap_angle(here.heading - start.pose.heading)) <= LOOP_TURN
        )
        looped = self.until_loop and self.way_followed >= LOOP_LENGTH and back
        return looped or self.is_limit_reached


def _pursue(x: float, y: float, speed: float, ahead: float) -> Twist:
    """Pure pursuit (Coulter, 1992) of a point in the base frame, slower in turns.

    Turns in place if the point is far to the side. In front of an obstacle the linear speed
    decreases and the angular speed does not, so the arc gets tighter.
    """
    angle, distance = atan2(y, x), max(hypot(x, y), 0.1)
    if abs(angle) > 1.0:
        return Twist(0.0, FASTEST_TURN if angle > 0.0 else -FASTEST_TURN)
    wanted = speed * max(0.3, 1.0 - (angle / 0.9) ** 2)
    angular = 2.0 * max(wanted, 0.2) * sin(angle) / distance
    linear = _limit_speed(wanted, ahead)
    if linear < 0.02:
        angular = copysign(max(abs(angular), SLOWEST_TURN), angle)
    return Twist(linear, min(max(angular, -FASTEST_TURN), FASTEST_TURN))


def _limit_speed(linear: float, ahead: float) -> float:
    """Limit a speed so that the robot can stop; `ahead` is the free distance ahead, metres."""
    return min(linear, max(0.0, 0.8 * (ahead - 0.05)))


def _direction_at(points: FloatArray, distance: float) -> FloatArray:
    """Return the (2,) unit direction of a curve at `distance` metres along it, or at its end."""
    last = min(round(distance / geometry.CURVE_STEP) + 1, len(points) - 1)
    step = points[last] - points[max(last - 2, 0)]
    direction: FloatArray = step / max(float(np.linalg.norm(step)), 1e-9)
    return direction


def _bend(points: FloatArray) -> float:
    """Return the angle by which the first 0.6 m of a curve turn, radians."""
    if len(points) < 12:
        return pi
    first, last = points[3] - points[0], points[11] - points[8]
    cross = first[0] * last[1] - first[1] * last[0]
    return abs(atan2(float(cross), float(first @ last)))
