"""How a simulation runs, whatever robot and world."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import ParameterError
from stack.parameters import parameter


@dataclass(frozen=True)
class SimulationSettings:
    """Rates of the simulation and how fast it may run."""

    physics_rate: float = parameter(500.0, "Hz", above=0.0, help="physics steps per second")
    solver_iterations: int = parameter(20, at_least=1, help="constraint solver's, per step")
    scene_rate: float = parameter(
        100.0, "Hz", above=0.0,
        help="how often people move, encoders are read and contacts are looked for",
    )  # fmt: skip
    clearance_rate: float = parameter(
        10.0, "Hz", above=0.0, help="how often the distance to the nearest thing is measured"
    )
    pace: float = parameter(
        0.0, at_least=0.0, help="simulated seconds per second; 0 is as fast as possible"
    )
    battery_charge: float = parameter(
        1.0, at_least=0.0, at_most=1.0, help="state of charge at the start"
    )

    def steps(self, name: str, period: float) -> int:
        """How many physics steps a period lasts.

        Raises:
            ParameterError: it is not a whole number of them, or none.
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
