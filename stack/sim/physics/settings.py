"""Settings of a simulation: rates and speed."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import ParameterError
from stack.parameters import parameter
from stack.schedule import Schedule


@dataclass(frozen=True)
class SimulationSettings:
    """Rates of the simulation, its speed and the battery charge at the start."""

    physics_rate: float = parameter(500.0, "Hz", above=0.0, help="physics steps per second")
    solver_iterations: int = parameter(
        20, at_least=1, help="constraint solver iterations per physics step"
    )
    scene_rate: float = parameter(
        100.0, "Hz", above=0.0,
        help="updates of people, encoders, battery and contacts per second",
    )  # fmt: skip
    clearance_rate: float = parameter(
        10.0, "Hz", above=0.0, help="measurements of the distance to the nearest obstacle"
    )
    pace: float = parameter(
        0.0, at_least=0.0, help="simulated seconds per wall second; 0: as fast as possible"
    )
    battery_charge: float = parameter(
        1.0, at_least=0.0, at_most=1.0, help="battery charge at the start"
    )

    def steps(self, name: str, period: float) -> int:
        """Return the number of physics steps in a period.

        Raises:
            ParameterError: the period is not a positive multiple of the physics period.
        """
        exact = period * self.physics_rate
        steps = round(exact)
        if steps < 1 or abs(exact - steps) > 1e-6 * steps:
            raise ParameterError(
                name,
                f"the {name} {period:g} s is not a multiple of the physics period "
                f"{1.0 / self.physics_rate:g} s",
                "choose a rate that divides the physics rate",
            )
        return steps

    def schedule(self, rate: float) -> Schedule:
        """Return the physics steps in which something with a rate is due; at most each of them."""
        return Schedule(max(self.physics_rate / rate, 1.0))
