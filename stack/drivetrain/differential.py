"""Differential drive: two sides that roll at different speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from stack.drivetrain.drivetrain import Drivetrain, Length, WheelGeometry, WheelLaw
from stack.drivetrain.limits import Limits
from stack.types import Pose2D


@dataclass(frozen=True)
class Wheels(WheelGeometry):
    """Wheels of a differential drive.

    Attributes:
        left: URDF joints of the left wheels.
        right: URDF joints of the right wheels.
        radius: metres.
        separation: distance between the centres of left and right wheels, metres.
        effective_track: the separation that gives the turn, as calibrated, metres; None: the
            separation.
        effective_radii: of the left and the right wheels, as calibrated, metres.
    """

    left: tuple[str, ...]
    right: tuple[str, ...]
    radius: float
    separation: float
    effective_track: float | None = None
    effective_radii: tuple[float, ...] = ()
    turning_key: ClassVar[str] = "effective_track"

    @property
    def turning_length(self) -> float:
        """The effective track."""
        return self.separation if self.effective_track is None else self.effective_track

    @property
    def places(self) -> Mapping[str, Pose2D]:
        """Centres of the wheels, base frame; those of one side may be anywhere along it."""
        return places_on_sides(self.left, self.right, Pose2D(0.0, 0.0), self.separation)

    def lengths(self, at: Mapping[str, tuple[float, float]]) -> Sequence[Length]:
        """Compare the separation with the URDF's."""
        apart = mean_of(at, self.left)[1] - mean_of(at, self.right)[1]
        return [Length("separation", "separation", self.separation, apart)]

    def drivetrain(self, limits: Limits) -> Drivetrain:
        """Return the drivetrain with these wheels."""
        return Differential(self, limits)


def places_on_sides(
    left: Sequence[str], right: Sequence[str], middle: Pose2D, separation: float
) -> dict[str, Pose2D]:
    """Return the centres of wheels on two sides of a point, driving along x."""
    sides = ((left, separation / 2.0), (right, -separation / 2.0))
    return {
        joint: Pose2D(middle.x, middle.y + aside) for joints, aside in sides for joint in joints
    }


def mean_of(at: Mapping[str, tuple[float, float]], joints: Sequence[str]) -> tuple[float, float]:
    """Return the mean position of some wheels."""
    x, y = (sum(at[joint][axis] for joint in joints) / len(joints) for axis in (0, 1))
    return x, y


class Differential(Drivetrain):
    """Differential drive: wheel speed (v -+ w b / 2) / r with track b and wheel radius r."""

    kind = "differential"

    def __init__(self, wheels: Wheels, limits: Limits) -> None:
        super().__init__(wheels, limits)
        self._wheels = wheels
        self.track, self.effective_track = wheels.separation, wheels.turning_length

    @property
    def driven_joints(self) -> tuple[str, ...]:
        """URDF joints of the left wheels, then of the right wheels."""
        return self._wheels.left + self._wheels.right

    @property
    def law(self) -> WheelLaw:
        """Each side rolls at v -+ w b / 2."""
        wheels, half, radius = self._wheels, self.effective_track / 2.0, self.radii[0]
        share = radius / self.radii[1]
        left, right = (1.0, 0.0, -half), (share, 0.0, share * half)
        return WheelLaw((left,) * len(wheels.left) + (right,) * len(wheels.right), radius)

    def encoder_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """Mean angle of each side, left and right."""
        count = len(self._wheels.left)
        left, right = wheels[:count], wheels[count:]
        return sum(left) / len(left), sum(right) / len(right)

    def from_wheels(
        self, rolled: Sequence[float], slips: Sequence[float], steering: Sequence[float] = ()
    ) -> Pose2D:
        """Displacement forward, the mean of both sides; turn (right - left) / track."""
        left, right = rolled[0] + slips[0], rolled[1] + slips[1]
        return Pose2D((left + right) / 2.0, 0.0, (right - left) / self.effective_track)

    def wheel_force(self, force: float, moment: float) -> float:
        """Both sides push; they turn the base by a couple with the separation as its arm."""
        count = len(self.driven_joints)
        return (force + 2.0 * moment / self.effective_track) / count
