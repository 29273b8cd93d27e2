"""Commands that do not arrive."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter
from stack.sim.faults.fault import Fault, Target


@dataclass(frozen=True)
class LinkParameters:
    """Parameters of `LinkLoss`."""

    noticed: bool = parameter(
        False, help="whether the body says so, as a MAVLink rover does; `failsafe.link` then acts",
        public=True,
    )  # fmt: skip


class LinkLoss(Fault):
    """Commands do not reach the robot, measurements arrive: its dead-man stops it."""

    Parameters = LinkParameters

    def begin(self, target: Target) -> None:
        """Let no command through."""
        target.robot.link = "noticed" if self.parameters.noticed else "lost"

    def end(self, target: Target) -> None:
        """Let commands through."""
        target.robot.link = ""
