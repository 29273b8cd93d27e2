"""Where a station sends the robot: a place, a velocity, or the sticks of a joystick."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, isfinite, sin
from typing import Any

from stack.mavlink.frames import enu_heading, flu_twist
from stack.telemetry.mavlink.geography import GLOBAL_FRAMES, NO_ORIGIN, Geography
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.modes import NO_MANUAL, Mode, Modes
from stack.telemetry.mavlink.orders import Done, Orders
from stack.telemetry.mavlink.plan_runner import CRUISE_SPEED
from stack.telemetry.mavlink.texts import WARNING, Texts
from stack.types import Pose2D

GOAL_TAG, VELOCITY_TAG = "mavlink goal", "mavlink velocity"

LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED, BODY_FRD = 1, 7, 8, 9, 12
_BODY = (BODY_NED, BODY_OFFSET_NED, BODY_FRD)

NO_POSITION, NO_VELOCITY = 0b111, 0b111 << 3
NO_ACCELERATION, NO_YAW, NO_YAW_RATE = 0b111 << 6, 1 << 10, 1 << 11
"""Bits of type_mask for what is to be ignored."""

SAME_GOAL = 0.05
"""Metres: stations repeat the same target many times a second."""

GOAL_PERIOD = 0.5
"""Least wall seconds between two changes of the goal: each one plans a new drive."""

TEXT_PERIOD = 5.0
TURN_RATE = 1.0
"""rad/s at the end of a stick; the limits of the robot apply."""

STICK = 1000.0
VELOCITY_TIME, VELOCITY_SILENCE = 86400.0, 3.0
"""Seconds that velocities may drive, and without a velocity after which the robot only stands."""


class Guidance:
    """Drives to goals and at velocities, in GUIDED, and by the sticks in MANUAL."""

    def __init__(  # noqa: PLR0913
        self, handover: Handover, orders: Orders, modes: Modes, geography: Geography, texts: Texts,
        clock: Callable[[], float],
    ) -> None:  # fmt: skip
        self._handover, self._orders, self._modes = handover, orders, modes
        self._geography, self._texts, self._clock = geography, texts, clock
        self._goal: Pose2D | None = None
        self._changed = self._told = -TEXT_PERIOD
        self._begins_velocity = False

    def go_to(self, x: float, y: float, heading: float | None, done: Done) -> None:
        """Drive to a place of the map and stay in GUIDED.

        Args:
            x: metres.
            y: metres.
            heading: on the map; None: as the robot arrives.
            done: called when the drive has begun or was refused.
        """
        snapshot = self._handover.snapshot
        if snapshot is None:
            done("the mission has not started")
            return
        here = snapshot.pose
        if heading is None:
            heading = here.bearing_to(Pose2D(x, y))
        goal = Pose2D(x, y, heading)

        def begun(refusal: str) -> None:
            if not refusal:
                self._modes.wanted = Mode.GUIDED
            done(refusal)

        self._goal, self._changed = goal, self._clock()
        self._modes.leave_plan()
        self._orders.give("set_goal", begun, x=x, y=y, heading=heading, tag=GOAL_TAG)

    def reposition(
        self, frame: int | None, latitude: int, longitude: int, yaw: float, done: Done
    ) -> None:
        """Drive to a place on Earth, 1e-7 degrees; NaN as yaw means any."""
        place = self._geography.place(latitude, longitude)
        if frame not in GLOBAL_FRAMES or place is None:
            done(NO_ORIGIN if place is None else f"frame {frame} is not supported")
            return
        self.go_to(*place, self._heading(yaw), done)

    def take_global_target(self, message: Any) -> None:
        """Follow a SET_POSITION_TARGET_GLOBAL_INT with a position, in GUIDED."""
        if self._modes.shown is not Mode.GUIDED or message.type_mask & NO_POSITION & 0b011:
            return
        place = self._geography.place(message.lat_int, message.lon_int)
        if message.coordinate_frame not in GLOBAL_FRAMES or place is None:
            self._tell_now_and_then(NO_ORIGIN)
            return
        self._follow(*place, self._yaw_of(message))

    def take_local_target(self, message: Any) -> None:
        """Follow a SET_POSITION_TARGET_LOCAL_NED in GUIDED: a position, or else a velocity."""
        if self._modes.shown is not Mode.GUIDED:
            return
        mask = message.type_mask
        if not mask & NO_POSITION & 0b011:
            if isfinite(message.x) and isfinite(message.y):
                self._take_position(message)
        elif mask & NO_VELOCITY & (1 << 3) == 0:
            self._take_velocity(message)

    def _take_position(self, message: Any) -> None:
        snapshot, frame = self._handover.snapshot, message.coordinate_frame
        if snapshot is None:
            return
        here = snapshot.pose
        if frame in _BODY:
            left = -message.y
            c, s = cos(here.heading), sin(here.heading)
            x, y = here.x + c * message.x - s * left, here.y + s * message.x + c * left
        elif frame in (LOCAL_NED, LOCAL_OFFSET_NED):
            x, y = self._geography.from_enu(message.y, message.x)
            if frame == LOCAL_OFFSET_NED:
                x, y = here.x + x, here.y + y
        else:
            self._tell_now_and_then(f"frame {frame} is not supported; use 1, 7, 8 or 9")
            return
        self._follow(x, y, self._yaw_of(message))

    def _follow(self, x: float, y: float, heading: float | None) -> None:
        """Drive to a target that is repeated: only a new one plans a new drive."""
        goal = self._goal
        same = goal is not None and goal.distance_to(Pose2D(x, y)) < SAME_GOAL
        if same or self._clock() - self._changed < GOAL_PERIOD:
            return
        self.go_to(x, y, heading, self._tell_refusal)

    def _take_velocity(self, message: Any) -> None:
        """Drive at a velocity until the next one, half a second of the robot's clock at most."""
        snapshot, frame = self._handover.snapshot, message.coordinate_frame
        values = (
            message.vx,
            message.vy,
            0.0 if message.type_mask & NO_YAW_RATE else message.yaw_rate,
        )
        if snapshot is None or not all(map(isfinite, values)):
            return
        forward, right = message.vx, message.vy
        if frame in (LOCAL_NED, LOCAL_OFFSET_NED):
            x, y = self._geography.from_enu(message.vy, message.vx)
            c, s = cos(snapshot.pose.heading), sin(snapshot.pose.heading)
            forward, right = c * x + s * y, s * x - c * y
        elif frame not in _BODY:
            self._tell_now_and_then(f"frame {frame} is not supported; use 1, 7, 8 or 9")
            return
        self._goal = None
        if snapshot.teleop and snapshot.detour:
            self._begins_velocity = False
            self._steer(forward, right, values[2])
        elif not self._begins_velocity:
            self._begins_velocity = True
            ports = [f"time={VELOCITY_TIME:g}", f"silence={VELOCITY_SILENCE:g}"]
            self._orders.give(
                "behaviour", self._velocity_begun, name="assisted_teleop", ports=ports,
                tag=VELOCITY_TAG,
            )  # fmt: skip

    def _velocity_begun(self, refusal: str) -> None:
        self._begins_velocity = False
        self._tell_refusal(refusal)

    def _steer(self, forward: float, right: float, rate: float) -> None:
        linear, lateral, angular = flu_twist(forward, right, rate)
        self._orders.give(
            "teleop", self._tell_refusal, linear=linear, lateral=lateral, angular=angular
        )

    def take_sticks(self, message: Any) -> None:
        """Drive by MANUAL_CONTROL in MANUAL: z is the throttle and y the steering, as ArduRover."""
        snapshot = self._handover.snapshot
        if self._modes.shown is not Mode.MANUAL or snapshot is None:
            return
        if not snapshot.teleop:
            self._tell_now_and_then(NO_MANUAL)
            return
        throttle, steering = (
            0.0 if abs(axis) > STICK else axis / STICK for axis in (message.z, message.y)
        )
        fastest = snapshot.parameters.get(CRUISE_SPEED)
        speed = float(fastest) if isinstance(fastest, int | float) else 0.0
        self._steer(throttle * speed, 0.0, steering * TURN_RATE)

    def _yaw_of(self, message: Any) -> float | None:
        return None if message.type_mask & NO_YAW else self._heading(message.yaw)

    def _heading(self, yaw: float) -> float | None:
        """Heading on the map of a yaw from north; None for NaN."""
        if not isfinite(yaw):
            return None
        origin = self._geography.origin
        heading = enu_heading(yaw)
        return heading if origin is None else origin.from_enu(heading)

    def _tell_refusal(self, refusal: str) -> None:
        if refusal:
            self._tell_now_and_then(refusal)

    def _tell_now_and_then(self, text: str) -> None:
        if self._clock() - self._told >= TEXT_PERIOD:
            self._told = self._clock()
            self._texts.tell(text, WARNING)
