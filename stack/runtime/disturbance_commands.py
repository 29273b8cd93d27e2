"""Commands that disturb a simulated world; a real body refuses them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

from stack.body import Body, DisturbedWorld
from stack.errors import InputError
from stack.parameters import FARTHEST, REQUIRED, parameter
from stack.types import (
    Disturbance,
    DroppedBox,
    LiftedRobot,
    MovedDoor,
    Pose2D,
    PushedRobot,
    SetCharge,
    SilencedSensor,
)


@dataclass(frozen=True)
class BoxArguments:
    """Arguments of `drop_box`."""

    x: float | None = parameter(
        None, "m", at_least=-FARTHEST, at_most=FARTHEST, help="x; default: before the robot"
    )
    y: float | None = parameter(None, "m", at_least=-FARTHEST, at_most=FARTHEST, help="y, with x")
    heading: float = parameter(0.0, "rad", at_least=-2 * pi, at_most=2 * pi, help="heading")
    length: float = parameter(0.4, "m", at_least=0.05, at_most=3.0, help="length")
    width: float = parameter(0.4, "m", at_least=0.05, at_most=3.0, help="width")
    height: float = parameter(0.5, "m", at_least=0.05, at_most=3.0, help="height")

    @property
    def disturbance(self) -> Disturbance:
        """What is done."""
        size = (self.length, self.width, self.height)
        if (self.x is None) != (self.y is None):
            raise InputError("drop_box: x and y are given together, or neither")
        if self.x is None or self.y is None:
            return DroppedBox(None, size)
        return DroppedBox(Pose2D(self.x, self.y, self.heading), size)


@dataclass(frozen=True)
class DoorArguments:
    """Arguments of `move_door`."""

    name: str = parameter("", help="of the door; default: the nearest one")
    closed: bool | None = parameter(None, help="default: the other way than it is")

    @property
    def disturbance(self) -> Disturbance:
        """What is done."""
        return MovedDoor(self.name, self.closed)


@dataclass(frozen=True)
class PushArguments:
    """Arguments of `push_robot`."""

    forward: float = parameter(0.0, "m", at_least=-3.0, at_most=3.0, help="forward")
    left: float = parameter(0.0, "m", at_least=-3.0, at_most=3.0, help="to the left")
    turn: float = parameter(0.0, "rad", at_least=-pi, at_most=pi, help="anticlockwise")

    @property
    def disturbance(self) -> Disturbance:
        """What is done."""
        return PushedRobot(Pose2D(self.forward, self.left, self.turn))


@dataclass(frozen=True)
class LiftArguments:
    """Arguments of `lift_robot`: a pose in the map frame."""

    x: float = parameter(REQUIRED, "m", at_least=-FARTHEST, at_most=FARTHEST, help="x")
    y: float = parameter(REQUIRED, "m", at_least=-FARTHEST, at_most=FARTHEST, help="y")
    heading: float = parameter(0.0, "rad", at_least=-2 * pi, at_most=2 * pi, help="heading")

    @property
    def disturbance(self) -> Disturbance:
        """What is done."""
        return LiftedRobot(Pose2D(self.x, self.y, self.heading))


@dataclass(frozen=True)
class SensorArguments:
    """Arguments of `silence_sensor`."""

    name: str = parameter(REQUIRED, help="of the sensor")
    works: bool = parameter(False, help="true: it works again")

    @property
    def disturbance(self) -> Disturbance:
        """What is done."""
        return SilencedSensor(self.name, self.works)


@dataclass(frozen=True)
class ChargeArguments:
    """Arguments of `set_charge`."""

    charge: float = parameter(REQUIRED, at_least=0.0, at_most=1.0, help="charge of the battery")

    @property
    def disturbance(self) -> Disturbance:
        """What is done."""
        return SetCharge(self.charge)


DISTURBANCES: dict[str, type] = {
    "drop_box": BoxArguments,
    "move_door": DoorArguments,
    "push_robot": PushArguments,
    "lift_robot": LiftArguments,
    "silence_sensor": SensorArguments,
    "set_charge": ChargeArguments,
}
"""Class of the arguments by kind of command."""


def disturbance_actions(body: Body) -> dict[str, Callable[[Any], None]]:
    """The action of each command on a body; it raises InputError if the body is no simulation."""

    def act(arguments: Any) -> None:
        if not isinstance(body, DisturbedWorld):
            raise InputError("only a simulated world can be disturbed: this robot is real")
        body.disturb(arguments.disturbance)

    return dict.fromkeys(DISTURBANCES, act)
