"""Motion models of the particle filter: odometry displacements with sampled errors.

Each kind of drive has errors of its own: a differential robot turns, drives and turns; an
omnidirectional one moves in any direction; the wheels of a skid-steered one slide in turns; a car
moves on arcs and never turns in place. Errors that odometry itself states (slip, pushes) are added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin, sqrt
from typing import Protocol

import numpy as np

from stack.drivetrain.drivetrain import Drivetrain
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.planar import rotation
from stack.types import FloatArray, Pose2D, wrap_angle

SKID_FACTOR = 4.0
"""Factor of alpha_1 and alpha_4 for skid-steered robots: their wheels slide in turns."""


class MotionModel(Protocol):
    """Samples the error of an odometry displacement."""

    def sample(
        self, poses: FloatArray, moved: Pose2D, generator: np.random.Generator
    ) -> FloatArray:
        """Return (n, 3) poses moved by an odometry displacement, each with a sampled error."""
        ...

    def covariance(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of these errors to first order, in the frame before it."""
        ...


@dataclass(frozen=True, slots=True)
class MotionNoise:
    """Odometry motion model of differential robots; the alphas scale variances as in AMCL.

    Attributes:
        skid: factor of the errors by rotation (alpha_1, alpha_4); above 1 for wheels that slide
            sideways in turns.
    """

    alpha_1: float
    alpha_2: float
    alpha_3: float
    alpha_4: float
    skid: float = 1.0

    def sample(
        self, poses: FloatArray, moved: Pose2D, generator: np.random.Generator
    ) -> FloatArray:
        """Return (n, 3) poses moved by an odometry displacement, each with a sampled error.

        Probabilistic Robotics, 2005, table 5.6: rotation, translation, rotation.
        """
        distance, first, second = self._parts(moved)
        errors = _errors(poses.shape[0], self._deviations(moved), generator)
        leaving = poses[:, 2] + first + errors[:, 0]
        gone = distance + errors[:, 1]
        sampled = np.empty(errors.shape)
        sampled[:, 0] = poses[:, 0] + gone * np.cos(leaving)
        sampled[:, 1] = poses[:, 1] + gone * np.sin(leaving)
        sampled[:, 2] = leaving + second + errors[:, 2]
        return sampled

    def covariance(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of these errors to first order, in the frame before it."""
        distance, first, _ = self._parts(moved)
        leaving, gone, arriving = self._deviations(moved)
        c, s = cos(first), sin(first)
        jacobian = np.array([[-s * distance, c, 0.0], [c * distance, s, 0.0], [1.0, 0.0, 1.0]])
        scaled = jacobian * [leaving, gone, arriving]
        total: FloatArray = scaled @ scaled.T
        return total

    @staticmethod
    def _parts(moved: Pose2D) -> tuple[float, float, float]:
        """Return distance, rotation before it and rotation after it."""
        first = atan2(moved.y, moved.x)
        return hypot(moved.x, moved.y), first, wrap_angle(moved.heading - first)

    def _deviations(self, moved: Pose2D) -> list[float]:
        """Return the deviations of first rotation, distance and second rotation."""
        distance, first, second = self._parts(moved)
        # Driving backward is not a half turn, a translation and a half turn.
        turn_1, turn_2 = (min(abs(a), pi - abs(a)) for a in (first, second))
        if distance < 0.01:
            # Below a centimetre the direction of travel is noise.
            turn_1, turn_2 = 0.0, abs(moved.heading)
        turning, shifting = self.skid * self.alpha_1, self.skid * self.alpha_4
        return [
            sqrt(turning * turn_1**2 + self.alpha_2 * distance**2),
            sqrt(self.alpha_3 * distance**2 + shifting * (turn_1**2 + turn_2**2)),
            sqrt(turning * turn_2**2 + self.alpha_2 * distance**2),
        ]


@dataclass(frozen=True, slots=True)
class OmniMotionNoise:
    """Motion model of omnidirectional robots, as AMCL's omnidirectional model.

    Rotation, translation, rotation would treat a sideways step as two quarter turns and blur the
    heading. Here the errors are along the motion, across it, and in the heading.
    """

    alpha_1: float
    alpha_2: float
    alpha_3: float
    alpha_4: float
    alpha_5: float

    def sample(
        self, poses: FloatArray, moved: Pose2D, generator: np.random.Generator
    ) -> FloatArray:
        """Return (n, 3) poses moved by an odometry displacement, each with a sampled error."""
        errors = _errors(poses.shape[0], self._deviations(moved), generator)
        going = poses[:, 2] + atan2(moved.y, moved.x)
        c, s = np.cos(going), np.sin(going)
        along, across = hypot(moved.x, moved.y) + errors[:, 0], errors[:, 1]
        return np.column_stack(
            [
                poses[:, 0] + along * c - across * s,
                poses[:, 1] + along * s + across * c,
                poses[:, 2] + moved.heading + errors[:, 2],
            ]
        )

    def covariance(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of these errors, in the frame before it."""
        going = atan2(moved.y, moved.x)
        scaled = rotation(going) * self._deviations(moved)
        total: FloatArray = scaled @ scaled.T
        return total

    def _deviations(self, moved: Pose2D) -> list[float]:
        """Return the deviations along the motion, across it, and of the heading."""
        distance, turn = moved.x**2 + moved.y**2, moved.heading**2  # both squared
        return [
            sqrt(self.alpha_3 * distance + self.alpha_4 * turn),
            sqrt(self.alpha_5 * distance + self.alpha_4 * turn),
            sqrt(self.alpha_1 * turn + self.alpha_2 * distance),
        ]


@dataclass(frozen=True, slots=True)
class CarMotionNoise:
    """Motion model of cars: an arc with errors in its length and in its turn.

    A car cannot turn without driving, so that all errors grow with the distance driven and a chord
    always leaves by half of the turn.
    """

    alpha_1: float
    alpha_2: float
    alpha_3: float

    def sample(
        self, poses: FloatArray, moved: Pose2D, generator: np.random.Generator
    ) -> FloatArray:
        """Return (n, 3) poses moved by an odometry displacement, each with a sampled error."""
        distance = hypot(moved.x, moved.y)
        errors = _errors(poses.shape[0], self._deviations(moved), generator)
        going = poses[:, 2] + atan2(moved.y, moved.x) + 0.5 * errors[:, 1]
        gone = distance + errors[:, 0]
        return np.column_stack(
            [
                poses[:, 0] + gone * np.cos(going),
                poses[:, 1] + gone * np.sin(going),
                poses[:, 2] + moved.heading + errors[:, 1],
            ]
        )

    def covariance(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of these errors to first order, in the frame before it."""
        going, half = atan2(moved.y, moved.x), 0.5 * hypot(moved.x, moved.y)
        c, s = cos(going), sin(going)
        scaled = np.array([[c, -s * half], [s, c * half], [0.0, 1.0]]) * self._deviations(moved)
        total: FloatArray = scaled @ scaled.T
        return total

    def _deviations(self, moved: Pose2D) -> list[float]:
        """Return the deviations of the length of the arc and of its turn."""
        distance = hypot(moved.x, moved.y)
        turn = abs(moved.heading) if distance >= 1e-3 else 0.0
        return [
            sqrt(self.alpha_3) * distance,
            sqrt(self.alpha_1 * turn**2 + self.alpha_2 * distance**2),
        ]


def motion_model(drivetrain: Drivetrain, parameters: LocaliserParameters) -> MotionModel:
    """Return the motion model of a drive."""
    p = parameters
    if drivetrain.can_move_sideways:
        return OmniMotionNoise(p.alpha_1, p.alpha_2, p.alpha_3, p.alpha_4, p.alpha_5)
    if not drivetrain.turns_in_place:
        return CarMotionNoise(p.alpha_1, p.alpha_2, p.alpha_3)
    skid = SKID_FACTOR if drivetrain.skids else 1.0
    return MotionNoise(p.alpha_1, p.alpha_2, p.alpha_3, p.alpha_4, skid)


def _errors(count: int, deviations: Sequence[float], generator: np.random.Generator) -> FloatArray:
    """Return (count, m) normally distributed errors of m standard deviations.

    The numbers are those of `generator.normal`, which is slow with several deviations.
    """
    errors: FloatArray = generator.standard_normal((count, len(deviations)))
    errors *= deviations
    return errors


def disturb(
    poses: FloatArray, headings: FloatArray, covariance: FloatArray, generator: np.random.Generator
) -> FloatArray:
    """Return (n, 3) poses with sampled errors of a displacement.

    Args:
        poses: (n, 3) after the displacement.
        headings: (n,) before it.
        covariance: (3, 3) of the displacement, in the frame at its start.
        generator: of the errors.
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    errors = generator.normal(0.0, 1.0, poses.shape) @ root.T
    c, s = np.cos(headings), np.sin(headings)
    return np.column_stack(
        [
            poses[:, 0] + c * errors[:, 0] - s * errors[:, 1],
            poses[:, 1] + s * errors[:, 0] + c * errors[:, 1],
            poses[:, 2] + errors[:, 2],
        ]
    )
