"""The robot for behaviours: its capabilities, its clock, its operator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from stack.robot.arm import Arm, Gripper
from stack.robot.base import Base
from stack.robot.localisation import Localisation
from stack.robot.map import Map
from stack.robot.perception import Perception
from stack.types import Battery, Image

JsonValue = str | float | Sequence["JsonValue"] | Mapping[str, "JsonValue"]


class Robot(Protocol):
    """Interface of the robot for behaviours: its capabilities, its clock, its operator.

    A behaviour that asks a capability of a robot without it finds nothing: `needs` of the behaviour
    lets `check` refuse such a mission.
    """

    @property
    def base(self) -> Base:
        """Its drive."""

    @property
    def localisation(self) -> Localisation:
        """Where it is."""

    @property
    def map(self) -> Map:
        """What it knows of its surroundings."""

    @property
    def arm(self) -> Arm:
        """Joints and motions of the arm.

        Raises:
            ParameterError: the robot has none.
        """

    @property
    def gripper(self) -> Gripper:
        """The gripper.

        Raises:
            ParameterError: the robot has none.
        """

    @property
    def perception(self) -> Perception:
        """What its sensors see."""

    @property
    def time(self) -> float:
        """Seconds on the robot's clock: simulated time in simulation."""

    @property
    def battery(self) -> Battery:
        """State of charge."""

    @property
    def recording_over(self) -> bool:
        """Whether all measurements of a replayed log have been played; else false."""

    def save_image(
        self, image: Image, name: str, *, details: Mapping[str, JsonValue] | None = None
    ) -> str:
        """Save a picture in the run's folder; returns its path relative to that folder.

        Args:
            image: to save.
            name: of the file, without suffix.
            details: saved beside the picture as a JSON file of the same name.
        """

    def say(self, text: str) -> None:
        """Show a text to the operator; recorded in the event log."""
