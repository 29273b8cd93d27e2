"""The robot that the stack drives, for behaviours: its capabilities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from stack.body import Body, Replay
from stack.navigation.capabilities.base import StackBase
from stack.navigation.capabilities.localisation import StackLocalisation
from stack.navigation.capabilities.map import StackMap
from stack.navigation.capabilities.perception import StackPerception
from stack.navigation.tasks import Emit
from stack.robot import JsonValue
from stack.types import Battery, CurrentStep, Image


class ImageStore(Protocol):
    """Saves images in the run's folder."""

    def save(self, image: Image, name: str, details: Mapping[str, JsonValue] | None = None) -> str:
        """Save an image, and details beside it; return its path relative to the folder."""


@dataclass(frozen=True)
class StackRobot:
    """Implements stack.robot.Robot.

    Attributes:
        body: whose clock counts.
        now: what the step has perceived.
        store: of pictures.
        emit: called with (kind, text, level="info", **fields) for each event.
    """

    base: StackBase
    localisation: StackLocalisation
    map: StackMap
    perception: StackPerception
    body: Body
    now: CurrentStep
    store: ImageStore
    emit: Emit

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
