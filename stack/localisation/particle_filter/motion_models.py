"""Motion models of the particle filter: odometry displacements with sampled errors.

Each kind of drive has errors of its own: a differential robot turns, drives and turns; an
omnidirectional one moves in any direction; the wheels of a skid-steered one slide in turns; a car
moves on arcs and never turns in place. Errors that odometry itself states (slip, pushes) are added.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import atan2, cos, hypot, pi, sin, sqrt

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.localisation.planar import rotation
from stack.types import FloatArray, Pose2D, wrap_angle

ALPHAS = (25.0, 25.0, 50.0, 2.5, 50.0)
"""Variance of rotation per rotation and per translation squared, of translation per translation and
per rotation squared (Probabilistic Robotics, 2005, table 5.6, in AMCL's convention), and across the
motion of omnidirectional robots (AMCL); all in squares of the wheels' slip. Several times the slip:
particles must also reach poses that the wheels do not explain."""

LEAST_SLIP = 0.005
"""Slip below which particles do not spread enough to be told apart by scans."""


class MotionModel(ABC):
    """Errors of an odometry displacement.

    Args:
        slip: standard deviation of a wheel's slip on its first metre, metres.
        sliding: relative standard deviation of a turn by the wheels besides slip.
    """

    def __init__(self, slip: float, sliding: float = 0.0) -> None:
        square = max(slip, LEAST_SLIP) ** 2
        squares = np.array([square, square, square, square, square])
        squares[[0, 3]] += sliding**2
        self._alphas: list[float] = np.multiply(ALPHAS, squares).tolist()

    def sample(
        self, poses: FloatArray, moved: Pose2D, generator: np.random.Generator
    ) -> FloatArray:
        """Return (n, 3) poses moved by an odometry displacement, each with a sampled error."""
        deviations = self._deviations(moved)
        # The numbers are those of `generator.normal`, which is slow with several deviations.
        errors: FloatArray = generator.standard_normal((poses.shape[0], len(deviations)))
        errors *= deviations
        return self._moved(poses, moved, errors)

    def covariance(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of these errors to first order, in the frame before it."""
        scaled = self._jacobian(moved) * self._deviations(moved)
        total: FloatArray = scaled @ scaled.T
        return total

    @abstractmethod
    def _deviations(self, moved: Pose2D) -> list[float]:
        """Return the standard deviations of the m errors."""

    @abstractmethod
    def _moved(self, poses: FloatArray, moved: Pose2D, errors: FloatArray) -> FloatArray:
        """Return poses (n, 3) moved with errors (n, m)."""

    @abstractmethod
    def _jacobian(self, moved: Pose2D) -> FloatArray:
        """Return the derivative (3, m) of the displacement with respect to the errors."""


class MotionNoise(MotionModel):
    """Motion model of differential robots: rotation, translation, rotation."""

    def _moved(self, poses: FloatArray, moved: Pose2D, errors: FloatArray) -> FloatArray:
        distance, first, second = self._parts(moved)
        leaving, gone = poses[:, 2] + first + errors[:, 0], distance + errors[:, 1]
        return np.column_stack([
            poses[:, 0] + gone * np.cos(leaving), poses[:, 1] + gone * np.sin(leaving),
            leaving + second + errors[:, 2],
        ])  # fmt: skip

    def _jacobian(self, moved: Pose2D) -> FloatArray:
        distance, first, _ = self._parts(moved)
        c, s = cos(first), sin(first)
        return np.array([[-s * distance, c, 0.0], [c * distance, s, 0.0], [1.0, 0.0, 1.0]])

    @staticmethod
    def _parts(moved: Pose2D) -> tuple[float, float, float]:
        """Return distance, rotation before it and rotation after it."""
        first = atan2(moved.y, moved.x)
        return hypot(moved.x, moved.y), first, wrap_angle(moved.heading - first)

    def _deviations(self, moved: Pose2D) -> list[float]:
        distance, first, second = self._parts(moved)
        # Driving backward is not a half turn, a translation and a half turn.
        turn_1, turn_2 = (min(abs(a), pi - abs(a)) for a in (first, second))
        if distance < 0.01:
            # Below a centimetre the direction of travel is noise.
            turn_1, turn_2 = 0.0, abs(moved.heading)
        a1, a2, a3, a4, _ = self._alphas
        return [
            sqrt(a1 * turn_1**2 + a2 * distance**2),
            sqrt(a3 * distance**2 + a4 * (turn_1**2 + turn_2**2)),
            sqrt(a1 * turn_2**2 + a2 * distance**2),
        ]


class OmniMotionNoise(MotionModel):
    """Motion model of omnidirectional robots: errors along the motion, across it, in the heading.

    Rotation, translation, rotation would treat a sideways step as two quarter turns and blur the
    heading.
    """

    def _moved(self, poses: FloatArray, moved: Pose2D, errors: FloatArray) -> FloatArray:
        going = poses[:, 2] + atan2(moved.y, moved.x)
        c, s = np.cos(going), np.sin(going)
        along, across = hypot(moved.x, moved.y) + errors[:, 0], errors[:, 1]
        return np.column_stack([
            poses[:, 0] + along * c - across * s, poses[:, 1] + along * s + across * c,
            poses[:, 2] + moved.heading + errors[:, 2],
        ])  # fmt: skip

    def _jacobian(self, moved: Pose2D) -> FloatArray:
        return rotation(atan2(moved.y, moved.x))

    def _deviations(self, moved: Pose2D) -> list[float]:
        distance, turn = moved.x**2 + moved.y**2, moved.heading**2  # both squared
        a1, a2, a3, a4, a5 = self._alphas
        return [
            sqrt(a3 * distance + a4 * turn),
            sqrt(a5 * distance + a4 * turn),
            sqrt(a1 * turn + a2 * distance),
        ]


class CarMotionNoise(MotionModel):
    """Motion model of cars: an arc with errors in its length and in its turn.

    A car cannot turn without driving, so that all errors grow with the distance driven and a chord
    always leaves by half of the turn.
    """

    def _moved(self, poses: FloatArray, moved: Pose2D, errors: FloatArray) -> FloatArray:
        going = poses[:, 2] + atan2(moved.y, moved.x) + 0.5 * errors[:, 1]
        gone = hypot(moved.x, moved.y) + errors[:, 0]
        return np.column_stack([
            poses[:, 0] + gone * np.cos(going), poses[:, 1] + gone * np.sin(going),
            poses[:, 2] + moved.heading + errors[:, 1],
        ])  # fmt: skip

    def _jacobian(self, moved: Pose2D) -> FloatArray:
        going, half = atan2(moved.y, moved.x), 0.5 * hypot(moved.x, moved.y)
        c, s = cos(going), sin(going)
        return np.array([[c, -s * half], [s, c * half], [0.0, 1.0]])

    def _deviations(self, moved: Pose2D) -> list[float]:
        distance = hypot(moved.x, moved.y)
        turn = abs(moved.heading) if distance >= 1e-3 else 0.0
        a1, a2, a3, _, _ = self._alphas
        return [sqrt(a3) * distance, sqrt(a1 * turn**2 + a2 * distance**2)]


def motion_model(robot: RobotDescription) -> MotionModel:
    """Return the motion model of a robot's drive, with the slip of its wheels."""
    slip = robot.odometry.slip
    if robot.drivetrain.can_move_sideways:
        return OmniMotionNoise(slip)
    if not robot.drivetrain.turns_in_place:
        return CarMotionNoise(slip)
    return MotionNoise(slip, robot.turn_deviation)


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
