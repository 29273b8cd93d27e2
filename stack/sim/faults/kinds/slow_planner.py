"""Plans that take long."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.sim.faults.fault import Fault
from stack.sim.worlds.world import World


@dataclass(frozen=True)
class SlowParameters:
    """Parameters of `SlowPlanner`."""

    latency: float = parameter(
        3.0, "s", at_least=0.0, at_most=60.0, public=True,
        help="time from the request of a plan to its use",
    )  # fmt: skip


class SlowPlanner(Fault):
    """Plans are used late: a busy computer. It changes `navigator.planning_latency`."""

    Parameters = SlowParameters

    @classmethod
    def lack(cls, parameters: SlowParameters, robot: RobotDescription, world: World) -> str:
        """Return that the robot plans no drives."""
        return "" if robot.drivetrain.moves else f"{robot.name} plans no drives"

    @property
    def settings(self) -> Mapping[str, float]:
        """The latency."""
        return {"navigator.planning_latency": self.parameters.latency}
