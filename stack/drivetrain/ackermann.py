"""Ackermann drive: a car with steered front wheels and driven rear wheels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan, copysign, degrees, isnan, nan, tan
from typing import ClassVar

from stack.drivetrain.differential import mean_of, places_on_sides
from stack.drivetrain.drivetrain import (
    DriveState,
    Drivetrain,
    Length,
    WheelCommand,
    WheelGeometry,
    WheelLaw,
)
from stack.drivetrain.limits import Limits
from stack.types import STANDSTILL, Pose2D, Twist

STEERED_FROM = 1e-3
"""Speed in m/s from which a twist determines the steering angle."""

STEERING, STEERED_WITHIN = 2e-3, 0.05
"""Speed in m/s of a car that stands and steers; radians from its angle within which it starts."""


@dataclass(frozen=True)
class SteeredWheels(WheelGeometry):
    """Wheels of a car: steered in front, driven at the rear.

    The base frame is midway between the rear wheels.

    Attributes:
        steering: URDF joints that turn the front wheels, left and right.
        rear: URDF joints of the driven wheels, left and right.
        radius: of the rear wheels, metres.
        wheelbase: distance between the axles, metres.
        track: distance between the rear wheels, metres.
        steering_angle: largest steering angle at the middle of the front axle, radians.
        steering_speed: rate of the steering angle, rad/s.
        steered_track: distance between the axes of the steering joints, metres; None: the track.
        effective_wheelbase: the wheelbase that gives the turn, as calibrated, metres; None: the
            wheelbase.
        effective_radii: of the rear wheels, left and right, as calibrated, metres.
    """

    steering: tuple[str, str]
    rear: tuple[str, str]
    radius: float
    wheelbase: float
    track: float
    steering_angle: float
    steering_speed: float
    steered_track: float | None = None
    effective_wheelbase: float | None = None
    effective_radii: tuple[float, ...] = ()
    turning_key: ClassVar[str] = "effective_wheelbase"

    @property
    def turning_length(self) -> float:
        """The effective wheelbase."""
        return self.wheelbase if self.effective_wheelbase is None else self.effective_wheelbase

    @property
    def half_steered_track(self) -> float:
        """From the middle of the front axle to the axis of a steering joint, metres."""
        return (self.track if self.steered_track is None else self.steered_track) / 2.0

    @property
    def turning_radius(self) -> float:
        """Radius of the tightest circle of the base frame's origin, metres."""
        return self.turning_length / tan(self.steering_angle)

    @property
    def places(self) -> Mapping[str, Pose2D]:
        """Centres of the rear wheels, base frame."""
        left, right = self.rear
        return places_on_sides([left], [right], Pose2D(0.0, 0.0), self.track)

    def lengths(self, at: Mapping[str, tuple[float, float]]) -> Sequence[Length]:
        """Compare the track and the wheelbase with the URDF's."""
        (left, right), (front_left, front_right) = self.rear, self.steering
        base = mean_of(at, self.steering)[0] - mean_of(at, self.rear)[0]
        front = at[front_left][1] - at[front_right][1]
        return [
            Length("track", "track of the rear wheels", self.track, at[left][1] - at[right][1]),
            Length("steering", "distance of the steering joints", abs(front), front),
            Length("wheelbase", "wheelbase", self.wheelbase, base),
        ]

    def as_modelled(self, at: Mapping[str, tuple[float, float]]) -> SteeredWheels:
        """Return the wheels with the distance of the steering joints.

        Raises:
            ValueError: the centre of the tightest circle is between these joints.
        """
        left, right = self.steering
        apart = at[left][1] - at[right][1]
        self._check_turning(apart, "steering joints")
        return replace(self, steered_track=apart)

    def check(self) -> None:
        """Check that the centre of the tightest circle is not between the rear wheels.

        Raises:
            ValueError: it is.
        """
        self._check_turning(self.track, "rear wheels")

    def _check_turning(self, track: float, of: str) -> None:
        if self.turning_radius <= track / 2.0:
            raise ValueError(
                f"wheels: with a steering_angle of {degrees(self.steering_angle):.0f} deg the "
                f"centre of rotation is {self.turning_radius:.2f} m from the middle, between the "
                f"{of}"
            )

    def drivetrain(self, limits: Limits) -> Drivetrain:
        """Return the drivetrain with these wheels."""
        return Ackermann(self, limits)


# The laws of a car as functions of numbers: numba compiles them too (kernels.py).


def steering_of(linear: float, angular: float, wheelbase: float, most: float) -> float:
    """Steering angle of the arc of a moving twist, within the largest angle `most`, radians."""
    angle = atan(angular * wheelbase / linear)
    return min(max(angle, -most), most)


def steered(
    linear: float, steering: float, speed: float, target: float, change: float
) -> tuple[float, float]:
    """Steering angle after a period, and the speed to drive at: slow until the wheels are turned.

    Args:
        linear: m/s, now.
        steering: radians, now; nan: unknown.
        speed: m/s, wanted.
        target: steering angle, wanted, radians.
        change: of the steering angle in a period, at most, radians.
    """
    if isnan(steering) or abs(target - steering) <= change:
        steering = target
    else:
        steering += change if target > steering else -change
    if abs(target - steering) > STEERED_WITHIN and abs(linear) <= STEERING:
        speed = copysign(STEERING, speed)
    return steering, speed


def rolling_wheels(  # noqa: PLR0913
    linear: float, curvature: float, wheelbase: float, track: float, half_steered: float,
    radius: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Speeds of the rear wheels, rad/s, and angles of the front wheels, radians; left and right.

    Args:
        linear: m/s.
        curvature: 1/m.
        wheelbase: metres.
        track: of the rear wheels, metres.
        half_steered: half the distance of the steering axes, metres.
        radius: of the rear wheels, metres.
    """
    offset, ahead, aside = curvature * track / 2.0, curvature * wheelbase, curvature * half_steered
    rolling = linear / radius
    left, right = atan(ahead / (1.0 - aside)), atan(ahead / (1.0 + aside))
    return rolling * (1.0 - offset), rolling * (1.0 + offset), left, right


class Ackermann(Drivetrain):
    """Steered front wheels and driven rear wheels with one common centre of rotation.

    R. W. Ackermann's condition (1818): the axles of all wheels intersect in one point on the line
    of the rear axle. With steering angle d at the middle of the front axle, wheelbase L, track b
    and distance c of the steering axes, the curvature is k = tan d / L, the front wheels are
    steered by atan(k L / (1 -+ k c / 2)) and the rear wheels roll at v (1 -+ k b / 2). The speed
    changes within the acceleration limits and the steering angle at the steering speed. At v = 0,
    tan d = w L / v is undefined and the steering angle is kept: a car cannot turn in place.
    """

    kind = "ackermann"
    turns_in_place = False

    def __init__(self, wheels: SteeredWheels, limits: Limits) -> None:
        super().__init__(wheels, limits)
        self._wheels = wheels
        self.turning_radius = wheels.turning_radius
        self.track = self.effective_track = wheels.track
        self._radius = sum(self.radii) / 2.0

    @property
    def at_rest(self) -> DriveState:
        """The state at standstill with wheels straight ahead."""
        return DriveState(STANDSTILL, 0.0)

    def feasible(self, twist: Twist) -> Twist:
        """The twist at the same linear velocity, no tighter than the turning radius."""
        most = abs(twist.linear) / self.turning_radius
        return Twist(twist.linear, min(max(twist.angular, -most), most))

    def state_at(self, twist: Twist, last: DriveState) -> DriveState:
        """Return the state in which the drive has a twist; near standstill `last` steers on."""
        if abs(twist.linear) < STEERED_FROM:
            return DriveState(twist, last.steering)
        return DriveState(twist, self._steering_of(twist))

    def limit_step(self, last: DriveState, wanted: Twist, period: float) -> DriveState:
        """Return the state after one period; an unknown steering angle may become any angle.

        A standing car steers before it drives off, or it would begin on the arc of its last drive.
        """
        wheels, speed, steering = self._wheels, wanted.linear, last.steering
        if abs(speed) >= STEERED_FROM:
            steering, speed = steered(
                last.twist.linear, nan if steering is None else steering, speed,
                self._steering_of(wanted), wheels.steering_speed * period,
            )  # fmt: skip
        linear = self.limits.limit_linear(last.twist.linear, speed, period)
        return DriveState(Twist(linear, linear * self._curvature(steering or 0.0)), steering)

    @property
    def driven_joints(self) -> tuple[str, ...]:
        """URDF joints of the left and the right rear wheel."""
        return self._wheels.rear

    @property
    def steering_limit(self) -> float:
        """Angle of the inner front wheel on the tightest arc, radians."""
        wheels = self._wheels
        return atan(wheels.turning_length / (wheels.turning_radius - wheels.half_steered_track))

    @property
    def law(self) -> WheelLaw:
        """Rear wheels that roll alike, and the numbers of the steering.

        Those are wheelbase, track, half the distance of the steering axes, radius, metres; largest
        steering angle, radians, and its rate, rad/s; turning radius, metres.
        """
        wheels = self._wheels
        return WheelLaw(
            ((1.0, 0.0, 0.0),) * len(wheels.rear), self._radius,
            (
                wheels.turning_length, wheels.track, wheels.half_steered_track, self._radius,
                wheels.steering_angle, wheels.steering_speed, wheels.turning_radius,
            ),
        )  # fmt: skip

    @property
    def steering_joints(self) -> tuple[str, ...]:
        """URDF joints that turn the left and the right front wheel."""
        return self._wheels.steering

    def to_wheels(self, state: DriveState) -> WheelCommand:
        """Speeds of the rear wheels and angles of the front wheels, left and right."""
        wheels, steering = self._wheels, state.steering
        if steering is None:
            steering = self.state_at(state.twist, self.at_rest).steering or 0.0
        left, right, left_angle, right_angle = rolling_wheels(
            state.twist.linear, self._curvature(steering), wheels.turning_length, wheels.track,
            wheels.half_steered_track, self._radius,
        )  # fmt: skip
        return WheelCommand((left, right), (left_angle, right_angle))

    def from_wheels(
        self, rolled: Sequence[float], slips: Sequence[float], steering: Sequence[float] = ()
    ) -> Pose2D:
        """Displacement forward by the rear wheels; curvature is the mean of both front wheels.

        Different slips of the two rear wheels also turn the car.
        """
        half, base = self._wheels.half_steered_track, self._wheels.turning_length
        curvature = 0.0
        if steering:
            left, right = (tan(angle) for angle in steering)
            curvature = (left / (base + half * left) + right / (base - half * right)) / 2.0
        forward = (rolled[0] + rolled[1]) / 2.0
        slipped = (slips[0] + slips[1]) / 2.0
        turn = forward * curvature + (slips[1] - slips[0]) / self._wheels.track
        return Pose2D(forward + slipped, 0.0, turn)

    def wheel_force(self, force: float, moment: float) -> float:
        """The rear wheels push; the steering turns the base."""
        return force / len(self._wheels.rear)

    def _steering_of(self, twist: Twist) -> float:
        """Steering angle of the arc of a moving twist, within the largest angle, radians."""
        wheels = self._wheels
        base = wheels.turning_length
        return steering_of(twist.linear, twist.angular, base, wheels.steering_angle)

    def _curvature(self, steering: float) -> float:
        return tan(steering) / self._wheels.turning_length
