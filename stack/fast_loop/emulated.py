"""Emulated wheels: a driver without hardware, for tests and for measurements of the loop."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, exp
from typing import Any

from stack.drivetrain.wheel_loop import OFF, REST
from stack.fast_loop.driver import Driver, DriverCommand, DriverFeedback, DriverSetup
from stack.parameters import parameter


@dataclass(frozen=True)
class EmulatedParameters:
    """Wheels with inertia and friction; efforts are in newton metres."""

    inertia: float = parameter(0.02, "kg m²", above=0.0, help="of a wheel and its share of robot")
    damping: float = parameter(0.05, "N m s", above=0.0, help="torque of friction per rad/s")
    friction: float = parameter(0.1, "N m", at_least=0.0, help="torque of dry friction")
    lag: float = parameter(
        0.005, "s", above=0.0, help="time constant of the drive's own control of speed"
    )


class Emulated(Driver):
    """Each wheel obeys J dw/dt = effort - d w - c sign(w), integrated exactly over a cycle.

    Without gains of the loop the emulated drive controls the speed itself: it follows with a lag of
    first order. Released wheels roll until friction stops them.
    """

    Parameters = EmulatedParameters

    def __init__(self, setup: DriverSetup, parameters: Any) -> None:
        super().__init__(setup, parameters)
        self._speeds, self._angles = [0.0] * setup.wheels, [0.0] * setup.wheels

    def exchange(self, command: DriverCommand, feedback: DriverFeedback) -> None:
        """Advance the wheels by one period."""
        period, is_off = command.period, command.level == OFF
        for wheel, before in enumerate(self._speeds):
            if is_off:
                after = self._rolled(before, 0.0, period)
            elif self.setup.controls_efforts:
                after = self._rolled(before, float(command.efforts[wheel]), period)
            else:
                wanted = float(command.speeds[wheel])
                after = wanted + (before - wanted) * exp(-period / self.parameters.lag)
                if wanted == 0.0 and abs(after) < REST:
                    after = 0.0
            self._speeds[wheel] = after
            self._angles[wheel] += period * (before + after) / 2.0
        feedback.speeds[:], feedback.angles[:] = self._speeds, self._angles
        feedback.stamps[:] = command.now
        feedback.steering[:] = command.steering

    def _rolled(self, speed: float, effort: float, period: float) -> float:
        """Speed after a period with a constant effort; dry friction holds a wheel that stands."""
        p = self.parameters
        dry = copysign(p.friction, speed or effort)
        if speed == 0.0 and abs(effort) <= p.friction:
            return 0.0
        final = (effort - dry) / p.damping
        after = float(final + (speed - final) * exp(-period * p.damping / p.inertia))
        return 0.0 if after * speed < 0.0 else after
