"""Motor that is too weak."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter
from stack.sim.faults.wheel_faults import SIDES, WheelFault


@dataclass(frozen=True)
class WeakParameters:
    """Parameters of `WeakMotor`."""

    power: float = parameter(
        0.6, at_least=0.05, at_most=1.0, public=True,
        help="share of the commanded speed that the wheel reaches; of the torque, if torques are"
        " commanded",
    )  # fmt: skip
    side: str = parameter("left", one_of=SIDES, help="whose wheels it drives")


class WeakMotor(WheelFault):
    """The wheels of a side turn slower than commanded, as encoders measure: a worn motor, heat."""

    Parameters = WeakParameters

    @property
    def share(self) -> float:
        """Share of the speed or torque that is left."""
        return float(self.parameters.power)
