"""How often a sensor delivers."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True, slots=True)
class SensorState:
    """How often a sensor delivers.

    Attributes:
        name: of the sensor.
        rate: measurements per second of the robot's clock in the last seconds, Hz.
        expected: Hz, by the robot file; 0: it states none, or nothing is requested now.
        age: seconds since its newest measurement; inf before the first.
    """

    name: str
    rate: float = 0.0
    expected: float = 0.0
    age: float = inf

    @property
    def is_slow(self) -> bool:
        """Whether it delivers less than 80 % of what is expected."""
        return self.rate < 0.8 * self.expected
