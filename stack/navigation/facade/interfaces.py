"""What the robot facade needs from detectors and from the store of pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from stack.robot import JsonValue
from stack.types import (
    ColourMask,
    Detection,
    FloatArray,
    FloorLines,
    Image,
    LineColour,
    MarkerSighting,
    ObjectColour,
    Pose2D,
)


class MarkerDetector(Protocol):
    """Detects known markers in images."""

    def sightings(self, image: Image) -> tuple[MarkerSighting, ...]:
        """Return the known markers in an image."""
        ...


class FloorLineDetector(Protocol):
    """Detects lines on the floor in images."""

    def see(
        self, image: Image, base: Pose2D, colour: LineColour, width: float, obstacles: FloatArray
    ) -> FloorLines:
        """Return the lines after an image that was taken at a base pose in the odom frame.

        Obstacles (n, 2), odom frame, hide the floor behind them.
        """
        ...


class ColouredObjectDetector(Protocol):
    """Detects coloured objects in images."""

    def detect(
        self, image: Image, colour: ObjectColour, base: Pose2D, ranges: FloatArray
    ) -> tuple[Detection, ...]:
        """Return the objects in an image that was taken at a base pose in the map frame.

        Points of the range sensors (n, 2), base frame, give distances.
        """
        ...

    def recent(self, stamp: float) -> tuple[Detection, ...]:
        """Return the objects in the last picture if it is not older than a stamp, seconds."""
        ...

    @property
    def mask(self) -> ColourMask | None:
        """Pixels of the colour in the last picture; None before the first one."""
        ...


class ObjectDetection(Protocol):
    """Searches pictures for objects."""

    def detections(self, now: float) -> tuple[Detection, ...] | None:
        """Return the newest detections and go on searching; None without recent ones."""
        ...

    def recent(self, now: float) -> tuple[Detection, ...] | None:
        """As `detections`, without asking for more."""
        ...


class ImageStore(Protocol):
    """Saves images in the run's folder."""

    def save(self, image: Image, name: str, details: Mapping[str, JsonValue] | None = None) -> str:
        """Save an image, and details beside it; return its path relative to the folder."""
        ...
