"""Push of the robot."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from stack.parameters import parameter
from stack.sim.faults.fault import NOW, Fault, Target
from stack.types import Pose2D, PushedRobot


@dataclass(frozen=True)
class PushParameters:
    """Parameters of `Push`."""

    forward: float = parameter(0.0, "m", at_least=-3.0, at_most=3.0, help="forward", public=True)
    left: float = parameter(0.3, "m", at_least=-3.0, at_most=3.0, help="to the left", public=True)
    turn: float = parameter(0.3, "rad", at_least=-pi, at_most=pi, help="anticlockwise")


class Push(Fault):
    """Somebody shoves the robot; its wheels do not measure that. Obstacles stop it."""

    Parameters = PushParameters
    kind = NOW

    def begin(self, target: Target) -> None:
        """Begin to move the body."""
        p = self.parameters
        target.disturb(PushedRobot(Pose2D(p.forward, p.left, p.turn)))
