"""Likelihood of a pose by markers: a mixture of its candidates and of a false measurement.

A distant marker has two poses with nearly the same image, and a marker may not be where the map
says. The likelihood of a pose x is p(z | x) = (1 - e) Σ wₖ N(x; zₖ, Rₖ) + e / V with the candidates
zₖ, their shares wₖ, and the share e of false measurements, which may be anywhere in the volume V of
poses (cf. the outlier process of Y. Bar-Shalom, T. Fortmann, "Tracking and Data Association", 1988,
chapter 6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log, pi

import numpy as np

from stack.localisation.planar import as_row, lever, rotation
from stack.types import FloatArray, Pose2D, PoseCandidate, wrap_angle


def carried(candidate: PoseCandidate, by: Pose2D, noise: FloatArray) -> PoseCandidate:
    """Return the candidate after a displacement.

    Args:
        candidate: before it.
        by: in the frame of the pose before it.
        noise: (3, 3) covariance of the displacement, in that frame.
    """
    heading = candidate.pose.heading
    change, turn = lever(heading, by), rotation(heading)
    covariance = change @ candidate.covariance @ change.T + turn @ noise @ turn.T
    return replace(
        candidate, pose=candidate.pose.compose(by), covariance=0.5 * (covariance + covariance.T)
    )


OUTLIERS = 0.02
"""Share of the pictures whose markers are not where the map says: moved, or taken for others."""


@dataclass(frozen=True, slots=True)
class Mixture:
    """Likelihood of poses by the markers in one picture.

    Attributes:
        components: the candidates.
        volume: of the poses among which a false measurement is, m² rad.
        outliers: share of false measurements.
    """

    components: Sequence[PoseCandidate]
    volume: float
    outliers: float = OUTLIERS

    def log_likelihoods(self, poses: FloatArray) -> FloatArray:
        """Return (n,) log-likelihoods of poses (n, 3), map frame."""
        logs = [np.full(len(poses), self._false)]
        for one in self.components:
            off = _off(poses, one.pose)
            squares = np.einsum("ni,ij,nj->n", off, np.linalg.inv(one.covariance), off)
            logs.append(self._weight(one, one.covariance) - 0.5 * squares)
        total: FloatArray = np.logaddexp.reduce(np.array(logs), axis=0)
        return total

    def evidence(self, pose: Pose2D, covariance: FloatArray) -> tuple[float, FloatArray]:
        """Return the log-likelihood of a normal distribution of the pose, and what explains it.

        Args:
            pose: mean, map frame.
            covariance: (3, 3).

        Returns:
            The log-likelihood, and the probabilities (k + 1,) of the candidates and, last, that the
            measurement is false.
        """
        logs = []
        for one in self.components:
            total = covariance + one.covariance
            off = _off(as_row(pose)[None], one.pose)[0]
            logs.append(self._weight(one, total) - 0.5 * float(off @ np.linalg.solve(total, off)))
        logs.append(self._false)
        evidence = float(np.logaddexp.reduce(logs))
        return evidence, np.exp(np.array(logs) - evidence)

    def posterior(self, pose: Pose2D, covariance: FloatArray) -> tuple[Pose2D, FloatArray]:
        """Return the mean and covariance of a normally distributed pose after the measurement.

        The posterior is a mixture; it is replaced by the normal distribution of its moments.
        """
        _, shares = self.evidence(pose, covariance)
        shifts: list[FloatArray] = []
        spreads: list[FloatArray] = []
        for one in self.components:
            gain = covariance @ np.linalg.inv(covariance + one.covariance)
            off = -_off(as_row(pose)[None], one.pose)[0]
            shifts.append(gain @ off)
            spreads.append(covariance - gain @ covariance)
        shifts.append(np.zeros(3))
        spreads.append(covariance)
        mean: FloatArray = shares @ np.array(shifts)
        after = np.zeros((3, 3))
        for share, shift, spread in zip(shares.tolist(), shifts, spreads, strict=True):
            after += share * (spread + np.outer(shift - mean, shift - mean))
        x, y, heading = (float(value) for value in mean)
        found = Pose2D(pose.x + x, pose.y + y, wrap_angle(pose.heading + heading))
        return found, 0.5 * (after + after.T)

    def information(self, shares: FloatArray) -> FloatArray:
        """Return the information (3, 3) of the measurement, given what explains it.

        Args:
            shares: as `evidence` returns them.
        """
        known = shares[:-1] / max(float(shares[:-1].sum()), 1e-12)
        rows = np.array([as_row(one.pose) for one in self.components])
        middle = self.components[int(np.argmax(known))].pose
        off = _off(rows, middle)
        mean = known @ off
        total = np.zeros((3, 3))
        for share, one, by in zip(known.tolist(), self.components, off, strict=True):
            total += share * (one.covariance + np.outer(by - mean, by - mean))
        inverse = np.asarray(np.linalg.inv(total), dtype=np.float64)
        return (1.0 - float(shares[-1])) * inverse

    @property
    def _false(self) -> float:
        return log(self.outliers) - log(self.volume)

    def _weight(self, one: PoseCandidate, covariance: FloatArray) -> float:
        scale = 0.5 * float(np.linalg.slogdet(2.0 * pi * covariance)[1])
        return log(1.0 - self.outliers) + log(max(one.share, 1e-9)) - scale


def _off(poses: FloatArray, centre: Pose2D) -> FloatArray:
    """Return (n, 3) differences of poses (n, 3) from a pose."""
    off: FloatArray = poses - as_row(centre)
    off[:, 2] = (off[:, 2] + pi) % (2.0 * pi) - pi
    return off
