"""The robot that the stack drives, for behaviours: its capabilities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, TypeVar

from stack.body import Body, Replay
from stack.errors import ParameterError
from stack.navigation.capabilities.arm import StackArm
from stack.navigation.capabilities.base import StackBase
from stack.navigation.capabilities.gripper import StackGripper
from stack.navigation.capabilities.limbs import ArmStage
from stack.navigation.capabilities.map import StackMap
from stack.navigation.capabilities.perception import StackPerception
from stack.navigation.tasks import Emit
from stack.robot import JsonValue, Localisation
from stack.types import Battery, CurrentStep, Image

Part = TypeVar("Part")


class ImageStore(Protocol):
    """Saves images in the run's folder."""

    def save(self, image: Image, name: str, details: Mapping[str, JsonValue] | None = None) -> str:
        """Save an image, and details beside it; return its path relative to the folder."""


@dataclass(frozen=True)
class StackRobot:
    """Implements stack.robot.Robot.

    Attributes:
        drive: motions of the base; None if it is fixed.
        localisation: where the robot is.
        charted: the map; None for a fixed base.
        perception: what the sensors see.
        limbs: arm and gripper, if the robot has them.
        body: whose clock counts.
        now: what the step has perceived.
        store: of pictures.
        emit: called with (kind, text, level="info", **fields) for each event.
    """

    drive: StackBase | None
    localisation: Localisation
    charted: StackMap | None
    perception: StackPerception
    body: Body
    now: CurrentStep
    store: ImageStore
    emit: Emit
    limbs: ArmStage

    @property
    def base(self) -> StackBase:
        return self._had(self.drive, "base")

    @property
    def map(self) -> StackMap:
        return self._had(self.charted, "base")

    @property
    def arm(self) -> StackArm:
        return self._had(self.limbs.arm, "arm")

    @property
    def gripper(self) -> StackGripper:
        return self._had(self.limbs.gripper, "gripper")

    def _had(self, part: Part | None, need: str) -> Part:
        """Return a part; raise ParameterError if the robot lacks it."""
        if part is None:
            name = self.body.description.name
            hint = f'declare needs = ("{need}",): then `check` refuses such robots'
            raise ParameterError("", f"{name} has no {need}; {hint}", hint)
        return part

    @property
    def time(self) -> float:
        return self.body.time

    @property
    def battery(self) -> Battery:
        return self.now.perceived.battery

    @property
    def recording_over(self) -> bool:
        return isinstance(self.body, Replay) and self.body.recording_over

    def save_image(
        self, image: Image, name: str, *, details: Mapping[str, JsonValue] | None = None
    ) -> str:
        return self.store.save(image, name, details)

    def say(self, text: str) -> None:
        self.emit("say", text)
