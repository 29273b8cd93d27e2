"""Rates of a simulation: its clock counts physics steps."""

from __future__ import annotations

from stack.errors import ParameterError
from stack.schedule import Schedule

PHYSICS_RATE = 500.0
"""Physics steps per second."""

PHYSICS_PERIOD = 1.0 / PHYSICS_RATE

SCENE_RATE = 100.0
"""Updates of people, encoders, battery and contacts per second."""

CLEARANCE_RATE = 10.0
"""Measurements of the distance to the nearest obstacle per second."""


def physics_steps(name: str, period: float) -> int:
    """Return the number of physics steps in a period.

    Raises:
        ParameterError: the period is not a positive multiple of the physics period.
    """
    exact = period * PHYSICS_RATE
    steps = round(exact)
    if steps < 1 or abs(exact - steps) > 1e-6 * steps:
        raise ParameterError(
            name,
            f"the {name} {period:g} s is not a multiple of the physics period {PHYSICS_PERIOD:g} s",
            "choose a rate that divides the physics rate",
        )
    return steps


def physics_schedule(rate: float) -> Schedule:
    """Return the physics steps in which something with a rate is due; at most each of them."""
    return Schedule(max(PHYSICS_RATE / rate, 1.0))
