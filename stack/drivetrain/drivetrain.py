"""Base class of the drivetrains: what a kind of drive can do, and how its wheels move the base.

There is one subclass for each kind: differential, skid-steered, omnidirectional, Ackermann, and
fixed: no drive at all.
Code outside this package asks a drivetrain what it can do and never which kind it is.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, cast

from stack.drivetrain.limits import Limits, limit_speed
from stack.types import STANDSTILL, Pose2D, Twist


@dataclass(frozen=True, slots=True)
class DriveState:
    """Velocity of a drive and angle of its steering.

    Attributes:
        twist: base frame.
        steering: angle at the middle of the steered axle, radians; None if it is unknown or the
            drive has no steered wheels. A car at standstill has an angle that its twist omits.
    """

    twist: Twist = STANDSTILL
    steering: float | None = None


@dataclass(frozen=True, slots=True)
class WheelCommand:
    """Setpoints of the wheels.

    Attributes:
        speeds: of the driven wheels, rad/s, in the order of `driven_joints`.
        steering: angles of the steered wheels, left and right, radians; empty without any.
    """

    speeds: tuple[float, ...]
    steering: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class WheelLaw:
    """What the compiled control loop knows of a drivetrain (stack/drivetrain/kernels.py).

    Attributes:
        rows: of each driven wheel, its rolling speed per unit of linear, lateral and angular speed.
        divisor: rolling speed / divisor is the speed in rad/s: the radius, if `rows` are in metres
            per metre and metres per radian.
        steering: of a car, as of `Ackermann.law`; empty without steered wheels.
        moves_sideways: whether the velocity changes along a straight line in x and y.
    """

    rows: tuple[tuple[float, float, float], ...]
    divisor: float
    steering: tuple[float, ...] = ()
    moves_sideways: bool = False


@dataclass(frozen=True, slots=True)
class Length:
    """A length that robot.yaml describes and the URDF has as well.

    Attributes:
        key: of `wheels` in robot.yaml.
        what: words for it in messages.
        described: metres, as described.
        modelled: metres, in the URDF.
    """

    key: str
    what: str
    described: float
    modelled: float


class WheelGeometry(ABC):
    """Geometry and URDF joints of the wheels of one kind of drive.

    Attributes:
        radius: of the driven wheels, metres.
        effective_radii: of the wheel of each encoder under load, as calibrated, metres; empty: the
            radius.
        turning_key: the calibrated length by which turns are divided, as robot.yaml calls it.
    """

    radius: float
    effective_radii: tuple[float, ...] = ()
    turning_key: ClassVar[str] = ""

    @property
    @abstractmethod
    def places(self) -> Mapping[str, Pose2D]:
        """Centre and driving direction of each driven wheel by joint, base frame.

        The mean of the positions is exact; single ones may be nominal, as those of several wheels
        on one side are.
        """

    @property
    def sides(self) -> Sequence[Sequence[str]]:
        """Joints of the wheels that stand for one driven wheel, the first; empty: each is one."""
        return ()

    @property
    @abstractmethod
    def turning_length(self) -> float:
        """The value of `turning_key`, metres; the described length if it is not calibrated."""

    def calibrated(self, radii: Sequence[float], turning: float) -> WheelGeometry:
        """Return the wheels with calibrated lengths.

        Args:
            radii: of the wheel of each encoder, metres.
            turning: value of `turning_key`, metres.
        """
        changed: Any = {"effective_radii": tuple(radii), self.turning_key: turning}
        wheels: WheelGeometry = replace(cast(Any, self), **changed)
        return wheels

    def check(self) -> None:  # noqa: B027 - most kinds have nothing to check
        """Check the values against each other.

        Raises:
            ValueError: the robot cannot drive with these wheels; the message says why.
        """

    @abstractmethod
    def lengths(self, at: Mapping[str, tuple[float, float]]) -> Sequence[Length]:
        """Compare the description with the URDF.

        Args:
            at: x and y of driven and steered wheels by joint, base frame, metres.
        """

    def as_modelled(self, at: Mapping[str, tuple[float, float]]) -> WheelGeometry:
        """Return the wheels with what only the URDF tells; as they are if that is nothing.

        Args:
            at: as of `lengths`.

        Raises:
            ValueError: the robot cannot drive with them; the message says why.
        """
        return self

    @abstractmethod
    def drivetrain(self, limits: Limits) -> Drivetrain:
        """Return the drivetrain with these wheels."""


class Drivetrain(ABC):
    """A kind of drive with the wheels and limits of one robot.

    Attributes:
        kind: the word for it in robot.yaml.
        moves: whether the robot can drive at all.
        turns_in_place: whether the robot can turn without driving.
        can_move_sideways: whether it can move along y of the base frame. Such a robot has no
            driving direction: its heading is independent of its motion.
        skids: whether wheels slide sideways in turns, so that the distances that they roll do not
            determine the heading.
        turning_radius: of the tightest circle of the base frame's origin, metres; 0 if the robot
            turns in place.
        track: distance between the centres of left and right wheels, metres; 0 without sides.
        effective_track: the track for which the difference of both sides gives the turn, metres;
            larger than `track` for wheels that skid.
        slides_along_axles: whether driven wheels slide freely along their axles (rollers).
        limits: of speed and acceleration.
        radii: of the wheel of each encoder, as calibrated, metres: an angle times it was rolled.
    """

    kind: ClassVar[str]
    moves: ClassVar[bool] = True
    turns_in_place: ClassVar[bool] = True
    can_move_sideways: ClassVar[bool] = False
    skids: ClassVar[bool] = False
    slides_along_axles: ClassVar[bool] = False
    turning_radius: float = 0.0
    track: float = 0.0
    effective_track: float = 0.0

    def __init__(self, wheels: WheelGeometry, limits: Limits) -> None:
        self.limits = limits
        self.radii = wheels.effective_radii or (wheels.radius,) * self.encoders

    @property
    def velocity_axes(self) -> int:
        """Number of independent velocity components: linear, angular and, with 3, lateral."""
        return 3 if self.can_move_sideways else 2

    @property
    def aligns_in_place(self) -> bool:
        """Whether the only way to another heading at the same position is a turn in place."""
        return self.turns_in_place and not self.can_move_sideways

    @property
    def at_rest(self) -> DriveState:
        """The state at standstill with wheels straight ahead."""
        return DriveState()

    def feasible(self, twist: Twist) -> Twist:
        """The feasible part of a twist, without regard to speed limits: no lateral velocity."""
        return Twist(twist.linear, twist.angular) if twist.lateral else twist

    def state_at(self, twist: Twist, last: DriveState) -> DriveState:
        """Return the state in which the drive has a twist; `last` is the state before."""
        return DriveState(twist)

    def limit_step(self, last: DriveState, wanted: Twist, period: float) -> DriveState:
        """Return the state after one period on the way to a feasible twist.

        Args:
            last: state at the start of the period.
            wanted: target velocity.
            period: seconds.
        """
        limits, now = self.limits, last.twist
        rise, fall = limits.linear_acceleration, limits.linear_deceleration
        turn = limits.angular_acceleration
        return DriveState(
            Twist(
                limit_speed(now.linear, wanted.linear, period, rise, fall),
                limit_speed(now.angular, wanted.angular, period, turn, turn),
            )
        )

    @property
    @abstractmethod
    def driven_joints(self) -> tuple[str, ...]:
        """URDF joints of the driven wheels."""

    @property
    def steering_joints(self) -> tuple[str, ...]:
        """URDF joints that turn wheels about the vertical axis, left and right."""
        return ()

    @property
    def steering_limit(self) -> float:
        """Largest angle of a single steered wheel, radians; 0 without any."""
        return 0.0

    @property
    @abstractmethod
    def law(self) -> WheelLaw:
        """Kinematics as numbers, for compiled code."""

    def to_wheels(self, state: DriveState) -> WheelCommand:
        """Inverse kinematics: setpoints of the wheels for a state."""
        law, twist = self._law, state.twist
        return WheelCommand(
            tuple(
                (x * twist.linear + y * twist.lateral + turn * twist.angular) / law.divisor
                for x, y, turn in law.rows
            )
        )

    @cached_property
    def _law(self) -> WheelLaw:
        return self.law

    @property
    def encoders(self) -> int:
        """Number of wheel distances that `from_wheels` needs."""
        return 2

    def encoder_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """Return the angles of the encoders from those of the driven wheels, radians."""
        return wheels

    @abstractmethod
    def from_wheels(
        self, rolled: Sequence[float], slips: Sequence[float], steering: Sequence[float] = ()
    ) -> Pose2D:
        """Forward kinematics: displacement of the base in its own frame.

        Args:
            rolled: distance rolled at each encoder, metres; with speeds in m/s the result is a
                velocity.
            slips: distance that each wheel slipped in addition, in the same unit.
            steering: angles of the steered wheels, left and right, radians.
        """

    @abstractmethod
    def wheel_force(self, force: float, moment: float) -> float:
        """Largest force at the rim of a driven wheel that pushes and turns the base, newtons.

        Args:
            force: on the base in any direction of motion, newtons.
            moment: on the base about the vertical axis, newton metres.
        """
