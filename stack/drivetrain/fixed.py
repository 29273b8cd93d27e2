"""No drive: a base that is fixed to a table, a wall or the floor, as that of many arms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from stack.drivetrain.drivetrain import DriveState, Drivetrain, Length, WheelGeometry, WheelLaw
from stack.drivetrain.limits import Limits
from stack.types import STANDSTILL, Pose2D, Twist


@dataclass(frozen=True)
class NoWheels(WheelGeometry):
    """The wheels of a robot that has none."""

    radius: float = 0.0

    @property
    def places(self) -> Mapping[str, Pose2D]:
        """None."""
        return {}

    @property
    def turning_length(self) -> float:
        """0: it does not turn."""
        return 0.0

    def lengths(self, at: Mapping[str, tuple[float, float]]) -> Sequence[Length]:
        """Nothing to compare."""
        return ()

    def drivetrain(self, limits: Limits) -> Drivetrain:
        """Return the drivetrain that stands still."""
        return FixedBase(self, limits)


class FixedBase(Drivetrain):
    """A base that cannot move."""

    kind = "fixed"
    moves = False
    turns_in_place = False

    def feasible(self, twist: Twist) -> Twist:
        """Only standstill is feasible."""
        return STANDSTILL

    def limit_step(self, last: DriveState, wanted: Twist, period: float) -> DriveState:
        """Return the state at standstill."""
        return DriveState()

    @property
    def driven_joints(self) -> tuple[str, ...]:
        """None."""
        return ()

    @property
    def law(self) -> WheelLaw:
        """No wheel."""
        return WheelLaw((), 1.0)

    @property
    def encoders(self) -> int:
        """None."""
        return 0

    def from_wheels(
        self, rolled: Sequence[float], slips: Sequence[float], steering: Sequence[float] = ()
    ) -> Pose2D:
        """No displacement."""
        return Pose2D(0.0, 0.0)

    def wheel_force(self, force: float, moment: float) -> float:
        """0: nothing pushes the base."""
        return 0.0
