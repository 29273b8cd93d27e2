"""Wheel that does not turn."""

from __future__ import annotations

from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription
from stack.drivetrain.wheel_loop import NO_GAINS
from stack.parameters import parameter
from stack.sim.faults.wheel_faults import SIDES, WheelFault
from stack.sim.worlds.world import World


@dataclass(frozen=True)
class StuckParameters:
    """Parameters of `StuckWheel`."""

    side: str = parameter("left", one_of=SIDES, help="whose wheels do not turn", public=True)


class StuckWheel(WheelFault):
    """The wheels of a side do not turn: a locked brake, something in the wheel."""

    Parameters = StuckParameters

    @classmethod
    def lack(cls, parameters: StuckParameters, robot: RobotDescription, world: World) -> str:
        """Return that the wheels cannot be held: without torque they roll."""
        if robot.wheel_control != NO_GAINS:
            return f"the wheels of {robot.name} are driven by torques and roll without them"
        return super().lack(parameters, robot, world)
