"""Measurements of the odometry filter; each knows how it changes the state."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from stack.localisation.fusion import kernels
from stack.types import FloatArray, wrap_angle

HEADING = 2
"""Number of the heading in the state: the only angle that a measurement observes directly."""


@dataclass(frozen=True, slots=True)
class StateMeasurement:
    """Parts of the state, measured directly.

    Attributes:
        stamp: seconds.
        name: of the source.
        parts: numbers of the parts of the state.
        values: (m,) measured.
        covariance: (m, m).
        gate: Mahalanobis distance beyond which the measurement is ignored.
    """

    stamp: float
    name: str
    parts: tuple[int, ...]
    values: FloatArray
    covariance: FloatArray
    gate: float = inf

    def apply(self, state: FloatArray, covariance: FloatArray) -> float:
        """Update the state in place; return the Mahalanobis distance."""
        model = np.zeros((len(self.parts), kernels.SIZE))
        innovation = np.empty(len(self.parts))
        for row, part in enumerate(self.parts):
            model[row, part] = 1.0
            innovation[row] = self.values[row] - state[part]
            if part == HEADING:
                innovation[row] = wrap_angle(float(innovation[row]))
        squared = kernels.update(state, covariance, model, innovation, self.covariance, self.gate)
        return float(squared**0.5)


@dataclass(frozen=True, slots=True)
class RelativePose:
    """Pose of the base in the frame of the keyframe, (3,), with its covariance (3, 3)."""

    stamp: float
    name: str
    pose: FloatArray
    covariance: FloatArray
    gate: float = inf

    def apply(self, state: FloatArray, covariance: FloatArray) -> float:
        """Update the state in place; return the Mahalanobis distance."""
        squared = kernels.update_relative(state, covariance, self.pose, self.covariance, self.gate)
        return float(squared**0.5)


@dataclass(frozen=True, slots=True)
class NewKeyframe:
    """The pose at this stamp becomes the keyframe."""

    stamp: float
    name: str

    def apply(self, state: FloatArray, covariance: FloatArray) -> float:
        """Copy the pose and its covariance to those of the keyframe."""
        kernels.set_keyframe(state, covariance)
        return 0.0
