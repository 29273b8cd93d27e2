"""Observations from single measurements."""

from __future__ import annotations

from stack.types import Measurement, Observation, Odometry


def observed(time: float, wheels: Odometry, **others: Measurement | None) -> Observation:
    """Wheel odometry and other measurements by sensor name; None is left out."""
    measured = {name: value for name, value in others.items() if value is not None}
    return Observation(time, {"wheels": wheels, **measured})
