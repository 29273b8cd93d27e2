"""Watch on the calibration of a camera: tells when what it shows is off, always to the same side.

Each miss is the difference of where fingers or a closer look found a thing, and where the camera
had shown it. Random errors go to all sides; an error of the mount does not. With equal variance
along all axes, n |mean|^2 / 3 over the variance of n misses is distributed as F with 3 and
3 (n - 1) degrees of freedom if the camera is right: the t test in space. Three misses suffice. The
tail of F is that of E. Paulson, "An Approximate Normalization of the Analysis of Variance
Distribution", Annals of Mathematical Statistics 13, 1942.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import atan2, degrees, erfc, sqrt

import numpy as np

from stack.types import FloatArray

LEAST_MISSES, KEPT = 3, 20
"""Misses that are needed, and the newest ones that count: after a knock the old ones fade."""

LEAST_OFFSET = 0.003
"""Metres; a smaller mean miss harms no grasp, so it is not reported however certain it is."""

CHANCE = 0.003
"""Largest probability of such misses of a camera that is right. It is tested after every miss, so
reports without a reason are some five times as frequent."""

LEAST_DEVIATION = 0.0005
"""Smallest standard deviation of a miss, metres: fingers and pictures resolve no more."""


@dataclass(frozen=True, eq=False, slots=True)
class CameraOffset:
    """A systematic error of a camera.

    Attributes:
        offset: (3,) mean of found minus expected, metres, in the frame of the places.
        deviation: standard deviation of that mean along each axis, metres.
        chance: probability of such misses if the camera is right.
        count: number of misses.
    """

    offset: FloatArray
    deviation: float
    chance: float
    count: int

    @property
    def distance(self) -> float:
        """Metres."""
        return float(np.linalg.norm(self.offset))

    def __str__(self) -> str:
        """A sentence for people, with size and direction."""
        x, y, z = (100.0 * float(value) for value in self.offset)
        parts = [
            f"{abs(value):.1f} cm {words[value < 0.0]}"
            for value, words in (
                (x, ("forward", "back")), (y, ("left", "right")), (z, ("up", "down")),
            ) if abs(value) >= 0.1
        ]  # fmt: skip
        return (
            f"things are {100.0 * self.distance:.1f} cm beside where the camera shows them "
            f"({', '.join(parts)}; mean of {self.count}, towards {self._bearing:.0f} deg): "
            "calibrate the camera's mount"
        )

    @property
    def _bearing(self) -> float:
        """Direction of the offset seen from above, degrees to the left of x."""
        return degrees(atan2(float(self.offset[1]), float(self.offset[0])))


class CalibrationWatch:
    """Collects the misses of one camera."""

    def __init__(self) -> None:
        self._misses: deque[FloatArray] = deque(maxlen=KEPT)

    def add(self, expected: FloatArray, found: FloatArray) -> None:
        """Take a miss.

        Args:
            expected: (3,) where the camera has shown a thing, metres.
            found: (3,) where it was, in the same frame, such as the arm's base link.
        """
        self._misses.append(np.asarray(found, np.float64) - np.asarray(expected, np.float64))

    def clear(self) -> None:
        """Forget all misses, as after a calibration."""
        self._misses.clear()

    @property
    def offset(self) -> CameraOffset | None:
        """With what offset the camera is wrong; None as long as that may be chance."""
        count = len(self._misses)
        if count < LEAST_MISSES:
            return None
        misses = np.array(self._misses)
        mean, free = misses.mean(axis=0), 3 * (count - 1)
        variance = max(float(np.square(misses - mean).sum()) / free, LEAST_DEVIATION**2)
        chance = f_tail(count * float(mean @ mean) / 3.0 / variance, 3, free)
        if chance > CHANCE or float(np.linalg.norm(mean)) < LEAST_OFFSET:
            return None
        return CameraOffset(mean, sqrt(variance / count), chance, count)


def f_tail(value: float, above: int, below: int) -> float:
    """Return the probability of a larger value of the F distribution.

    Args:
        value: not negative.
        above: degrees of freedom of the numerator.
        below: the same of the denominator, 3 or more.
    """
    a, b, root = 2.0 / (9.0 * above), 2.0 / (9.0 * below), value ** (1.0 / 3.0)
    normal = ((1.0 - b) * root - (1.0 - a)) / sqrt(b * root**2 + a)
    return 0.5 * erfc(normal / sqrt(2.0))
