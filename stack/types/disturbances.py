"""What an operator can do to a simulated world while a mission runs."""

from __future__ import annotations

from dataclasses import dataclass

from stack.types.geometry import Pose2D


@dataclass(frozen=True, slots=True)
class DroppedBox:
    """A box that appears on the floor; x, y and heading of its centre in the world frame.

    Attributes:
        pose: None: before the robot, one metre from its outline.
        size: length, width, height, metres.
    """

    pose: Pose2D | None = None
    size: tuple[float, float, float] = (0.4, 0.4, 0.5)


@dataclass(frozen=True, slots=True)
class MovedDoor:
    """A door that closes or opens.

    Attributes:
        name: of the door; empty: the nearest one.
        closed: None: the other way than it is.
    """

    name: str = ""
    closed: bool | None = None


@dataclass(frozen=True, slots=True)
class PushedRobot:
    """A shove of the robot by metres forward and to the left, and an angle, within a second."""

    by: Pose2D


@dataclass(frozen=True, slots=True)
class LiftedRobot:
    """The robot is put down at a pose of the world frame; its odometry does not notice."""

    pose: Pose2D


@dataclass(frozen=True, slots=True)
class SilencedSensor:
    """A sensor that delivers nothing any more, or works again."""

    name: str
    works: bool = False


@dataclass(frozen=True, slots=True)
class SetCharge:
    """A battery with this charge, in [0, 1]."""

    charge: float


Disturbance = DroppedBox | MovedDoor | PushedRobot | LiftedRobot | SilencedSensor | SetCharge
