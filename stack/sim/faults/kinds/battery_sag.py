"""Battery that measures less than it has."""

from __future__ import annotations

from dataclasses import dataclass, replace

from stack.parameters import parameter
from stack.sim.faults.fault import Fault, Measurements
from stack.types import Battery


@dataclass(frozen=True)
class SagParameters:
    """Parameters of `BatterySag`."""

    drop: float = parameter(
        0.6, at_least=0.0, at_most=1.0, help="by which the measured charge is lower", public=True
    )
    voltage: float = parameter(3.0, "V", at_least=0.0, help="by which the voltage is lower")


class BatterySag(Fault):
    """Voltage and charge of the battery fall, and are back afterwards: cold, a large load."""

    Parameters = SagParameters

    def measured(self, measurements: Measurements, time: float) -> Measurements:
        """Return the measurements with a lower charge."""
        battery = measurements.get("battery")
        if not isinstance(battery, Battery):
            return measurements
        charge = max(0.0, battery.charge - self.parameters.drop)
        voltage = max(0.0, battery.voltage - self.parameters.voltage)
        return {**measurements, "battery": replace(battery, charge=charge, voltage=voltage)}
