"""Wheels that slip."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter
from stack.sim.faults.wheel_faults import SIDES, WheelFault


@dataclass(frozen=True)
class SlipParameters:
    """Parameters of `WheelSlip`."""

    slip: float = parameter(
        0.3, at_least=0.0, at_most=0.95, public=True,
        help="share of the way that the wheels turn which does not move the robot",
    )  # fmt: skip
    side: str = parameter("all", one_of=SIDES, help="wheels that slip")


class WheelSlip(WheelFault):
    """Wheels turn further than they roll, which encoders do not measure: a wet or dusty floor."""

    Parameters = SlipParameters
    grip = True

    @property
    def share(self) -> float:
        """Share of the way that is left."""
        return 1.0 - float(self.parameters.slip)
