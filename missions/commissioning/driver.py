"""Drives a robot along lines and turns by its reference, and records what it measures."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, hypot, pi

import numpy as np

from missions.commissioning.reference import Reference
from stack.body import Body, BodyCommand
from stack.drivetrain.kinematics import moved
from stack.errors import BodyError
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.types import STANDSTILL, Observation, Pose2D, Twist, wrap_angle

PERIOD = 0.05
"""Seconds between two commands."""

FASTEST, SHARE = 0.6, 0.7
"""Speed of a drive in m/s, and its share of the robot's limit."""

FASTEST_TURN = 1.5
"""Turning speed, rad/s."""

CROSS_TRACK, ALONG_LINE = 4.0, 4.0
"""Steering towards a line, 1/m² and 1/m: critically damped, within a metre."""

BRAKING = 0.5
"""Share of the robot's deceleration with which a drive ends."""

SLOWEST, SLOWEST_TURN = 0.03, 0.08
"""m/s and rad/s, at the end of a drive."""

REACHED, TURNED = 0.01, 0.015
"""Metres and radians within which a drive ends."""

MARGIN, AHEAD = 0.08, (0.2, 0.5)
"""Metres kept free around the outline, now and so many seconds ahead."""

PATIENCE = 20.0
"""Seconds for which something may block a drive."""

LONGEST = 60.0
"""Seconds after which a single drive has failed."""


class Driver:
    """Drives by the poses of a reference.

    Args:
        body: the robot; it stands.
        reference: updated in each step.

    Attributes:
        observations: all that was measured.
        heading: of the base, not wrapped, radians.
    """

    def __init__(self, body: Body, reference: Reference) -> None:
        self.body, self.reference = body, reference
        self.observations: list[Observation] = []
        self.heading = 0.0
        limits = body.description.limits
        self.speed = min(FASTEST, SHARE * limits.linear_speed)
        self.reverse = min(self.speed, SHARE * limits.reverse_speed)
        self.turning = min(FASTEST_TURN, SHARE * limits.angular_speed)
        self._limits = limits
        self._blocked = 0.0

    @property
    def pose(self) -> Pose2D:
        """Pose of the base, frame of the reference."""
        return self.reference.pose

    def step(self, twist: Twist) -> None:
        """Measure, then command a velocity for one period; a blocked robot waits.

        Raises:
            BodyError: the robot does not respond, or was blocked for PATIENCE.
        """
        observation = self.body.sense()
        self.observations.append(observation)
        self.reference.update(observation)
        self.heading += wrap_angle(self.pose.heading - self.heading)
        problem = self.body.health.problem
        if problem:
            self.body.command(BodyCommand(STANDSTILL))
            raise BodyError(problem)
        if twist != STANDSTILL and self._is_blocked(twist):
            self._blocked += PERIOD
            if self._blocked > PATIENCE:
                self.body.command(BodyCommand(STANDSTILL))
                raise BodyError(f"something blocks the robot for {PATIENCE:g} s: clear the floor")
            twist = STANDSTILL
        elif twist != STANDSTILL:
            self._blocked = 0.0
        self.body.command(BodyCommand(twist))
        self.body.wait(PERIOD)

    def stand(self, seconds: float) -> None:
        """Stand still."""
        self._repeat(lambda: STANDSTILL, seconds)

    def turn_to(self, heading: float) -> None:
        """Turn in place to a heading, the shorter way."""
        self.turn(wrap_angle(heading - self.heading))

    def turn(self, angle: float) -> None:
        """Turn in place by an angle, radians, positive to the left."""
        target = self.heading + angle

        def wanted() -> Twist | None:
            left = target - self.heading
            if abs(left) < TURNED:
                return None
            slowing = (2.0 * BRAKING * self._limits.angular_acceleration * abs(left)) ** 0.5
            return Twist(0.0, copysign(max(SLOWEST_TURN, min(self.turning, slowing)), left))

        self._drive(wanted)
        self.stand(0.3)

    def drive_to(self, x: float, y: float, heading: float) -> None:
        """Drive along the line through a point with a heading, forward or in reverse, to it."""
        goal = Pose2D(x, y, heading)
        way = 1.0 if self.pose.relative_to(goal).x < 0.0 else -1.0
        fastest = self.speed if way > 0.0 else self.reverse

        def wanted() -> Twist | None:
            off = self.pose.relative_to(goal)
            left = -way * off.x
            if left < REACHED:
                return None
            slowing = (2.0 * BRAKING * self._limits.linear_deceleration * left) ** 0.5
            speed = way * max(SLOWEST, min(fastest, slowing))
            turn = -CROSS_TRACK * speed * off.y - ALONG_LINE * abs(speed) * off.heading
            return Twist(speed, min(max(turn, -self.turning), self.turning))

        self._drive(wanted)
        self.stand(0.4)

    def move_to(self, x: float, y: float) -> None:
        """Move to a point without turning; for robots that can move sideways."""
        held = self.heading

        def wanted() -> Twist | None:
            off = Pose2D(x, y, 0.0).relative_to(self.pose)
            left = hypot(off.x, off.y)
            if left < REACHED:
                return None
            slowing = (2.0 * BRAKING * self._limits.linear_deceleration * left) ** 0.5
            speed = max(SLOWEST, min(self.reverse, slowing))
            turn = min(max(2.0 * (held - self.heading), -self.turning), self.turning)
            return Twist(speed * off.x / left, turn, speed * off.y / left)

        self._drive(wanted)
        self.stand(0.4)

    def circle(self, radius: float, angle: float) -> None:
        """Drive on a circle, to the left for a positive angle, until the heading turned by it."""
        target = self.heading + angle
        speed = min(self.speed, self.turning * radius)

        def wanted() -> Twist | None:
            if copysign(1.0, angle) * (target - self.heading) < TURNED:
                return None
            return Twist(speed, copysign(speed / radius, angle))

        self._drive(wanted)
        self.stand(0.6)

    def _drive(self, wanted: Callable[[], Twist | None]) -> None:
        """Command what `wanted` returns until that is None.

        Raises:
            BodyError: the robot does not get there.
        """
        end = self.body.time + LONGEST
        while (twist := wanted()) is not None:
            if self.body.time > end:
                self.body.command(BodyCommand(STANDSTILL))
                raise BodyError(
                    f"the robot did not finish a drive in {LONGEST:g} s: is its drive enabled, and "
                    "does its lidar see walls?"
                )
            self.step(twist)

    def _repeat(self, wanted: Callable[[], Twist], seconds: float) -> None:
        end = self.body.time + seconds - 0.5 * PERIOD
        while self.body.time < end:
            self.step(wanted())

    def _is_blocked(self, twist: Twist) -> bool:
        """Whether the outline touches what the newest scan shows, going on like this."""
        points = self.reference.points
        if points is None or not len(points):
            return False
        corners = self.body.description.footprint.points
        radius = float(np.hypot(*corners.T).max()) + MARGIN + self.speed
        near = points[np.hypot(points[:, 0], points[:, 1]) < radius]
        if not len(near):
            return False
        now = distances_to_edges(near, corners)
        for seconds in AHEAD:
            there = moved(twist, seconds).inverse().transform(near)
            closer = distances_to_edges(there, corners)
            touching = (closer < MARGIN) | points_inside(there, corners)
            if bool((touching & (closer < now)).any()):
                return True
        return False


def full_turns(count: int) -> float:
    """Return the angle of full turns, radians."""
    return 2.0 * pi * count
