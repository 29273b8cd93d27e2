"""Skid-steered drive: fixed wheels on two sides, which slide sideways in turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from stack.drivetrain.differential import Differential, Wheels, places_on_sides
from stack.drivetrain.drivetrain import Drivetrain, Length, WheelGeometry
from stack.drivetrain.limits import Limits
from stack.parameters import parameter
from stack.types import Pose2D


@dataclass(frozen=True)
class SkidWheels(WheelGeometry):
    """Wheels of a skid-steered drive.

    Attributes:
        left: URDF joints of the left wheels.
        right: URDF joints of the right wheels.
        radius: metres.
        track: distance between the centres of left and right wheels, metres.
        effective_track: distance between the instantaneous centres of rotation of the left and the
            right side, as calibrated, metres. Odometry and wheel speeds use it.
        icr_offset: position of these centres along x of the base frame, as calibrated, metres.
        effective_radii: of the left and the right wheels, as calibrated, metres.
    """

    left: tuple[str, ...]
    right: tuple[str, ...]
    radius: float
    track: float
    effective_track: float
    icr_offset: float = 0.0
    effective_radii: tuple[float, ...] = ()
    turning_key: ClassVar[str] = "effective_track"

    @property
    def turning_length(self) -> float:
        """The effective track."""
        return self.effective_track

    @property
    def places(self) -> Mapping[str, Pose2D]:
        """Centres of the driven wheels, on the axle of the centres of rotation, base frame."""
        return places_on_sides(
            self.left[:1], self.right[:1], Pose2D(self.icr_offset, 0.0), self.track
        )

    @property
    def sides(self) -> Sequence[Sequence[str]]:
        """The wheels of the left and of the right side, which turn together."""
        return self.left, self.right

    def lengths(self, at: Mapping[str, tuple[float, float]]) -> Sequence[Length]:
        """Compare nothing: the URDF's wheels may be closer together than the track."""
        return []

    def drivetrain(self, limits: Limits) -> Drivetrain:
        """Return the drivetrain with these wheels."""
        return SkidSteered(self, limits)


@dataclass(frozen=True)
class Skid:
    """Sliding of the wheels of a skid-steered drive in turns. All random draws are seeded."""

    slip: float = parameter(
        1.0,
        at_least=0.0,
        at_most=1.0,
        help="share of the sliding; 0: the wheels follow the effective track exactly",
    )
    icr_ratio: float = parameter(
        1.5,
        at_least=1.0,
        at_most=4.0,
        help="distance between the centres of rotation of both sides, divided by the track",
    )
    floor_variation: float = parameter(
        0.03,
        at_least=0.0,
        at_most=0.3,
        help="standard deviation of that ratio between floors (friction zones), relative",
    )
    variation: float = parameter(
        0.03,
        at_least=0.0,
        at_most=0.3,
        help="standard deviation of that ratio along the way on one floor, relative",
    )
    variation_length: float = parameter(
        0.5, "m", above=0.0, help="distance rolled after which that variation is forgotten"
    )


class SkidSteered(Differential):
    """Skid-steered drive: instantaneous centres of rotation (ICR) of both sides.

    When the robot turns, the contact points of each side slide about a point further out than the
    wheels. Relative to the floor a side moves as one rigid tread that turns about its ICR at
    (x0, +-y0), so with tread speeds vl and vr

        w = (vr - vl) / (2 y0)    vx = (vl + vr) / 2    vy = -x0 w

    which is a differential drive with the effective track 2 y0. Valid on hard, level ground while
    the centrifugal force is small against friction. On such ground the ICRs depend little on the
    speeds, but they vary with floor, tyres and load.

    J. L. Martinez, A. Mandow, J. Morales, S. Pedraza, A. Garcia-Cerezo, "Approximating Kinematics
    for Tracked Mobile Robots", International Journal of Robotics Research 24(10), 2005; A. Mandow
    et al., "Experimental kinematics for wheeled skid-steer mobile robots", IROS 2007. Their
    steering efficiency index is track / (2 y0). For four equally loaded point contacts with
    Coulomb friction the balance of moments gives 2 y0 / track = 1 + (wheelbase / track)².
    """

    kind = "skid_steered"
    skids = True

    def __init__(self, wheels: SkidWheels, limits: Limits) -> None:
        left, right = wheels.left[:1], wheels.right[:1]  # the others of a side turn as the first
        rolling = Wheels(
            left, right, wheels.radius, wheels.effective_track,
            effective_radii=wheels.effective_radii,
        )  # fmt: skip
        super().__init__(rolling, limits)
        self.track, self._icr_offset = wheels.track, wheels.icr_offset

    def from_wheels(
        self, rolled: Sequence[float], slips: Sequence[float], steering: Sequence[float] = ()
    ) -> Pose2D:
        """Displacement forward and in heading; sideways if the ICRs are off the base's origin."""
        moved = super().from_wheels(rolled, slips, steering)
        return Pose2D(moved.x, -self._icr_offset * moved.heading, moved.heading)
