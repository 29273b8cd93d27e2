"""Where an object is, from the detections of several pictures."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot
from typing import cast

from behaviours.timer import Timer
from stack.errors import ParameterError
from stack.robot import Robot
from stack.types import Detection, ObjectColour

CONFIRMATIONS = 2
"""Pictures that must show an object at about the same place."""

SAME_PLACE, SIGMAS = 0.3, 3.0
"""Metres, and standard deviations, within which two detections are the same object."""

UNCONFIRMED_KEPT = 10.0
"""Seconds after which an unconfirmed detection is forgotten."""

BLIND_TIME = 3.0
"""Seconds without a picture, or without a result of the detector, after which it is silent."""


@dataclass(frozen=True, slots=True)
class WantedObject:
    """What is searched: objects of a colour, or of a label of the object detector.

    Raises:
        ParameterError: neither or both are set.
    """

    colour: str | None
    label: str | None

    def __post_init__(self) -> None:
        if (self.colour is None) == (self.label is None):
            raise ParameterError("colour", "expected either a `colour` or a `label`")

    def __str__(self) -> str:
        return f"{self.colour} object" if self.label is None else self.label

    @property
    def silence(self) -> str:
        """Why nothing is seen."""
        if self.label is None:
            return f"the camera gave no picture for {BLIND_TIME:g} s"
        return f"the object detector gave no result for {BLIND_TIME:g} s"


@dataclass(slots=True)
class SeenObject:
    """An object that one or more pictures have shown.

    Attributes:
        x: metres, map frame.
        y: metres, map frame.
        deviation: standard deviation of the position, metres.
        pictures: that showed it.
        stamp: of the newest one, seconds.
    """

    x: float
    y: float
    deviation: float
    pictures: int
    stamp: float

    def is_at(self, detection: Detection) -> bool:
        """Return whether a detection may be this object."""
        allowed = SAME_PLACE + SIGMAS * hypot(self.deviation, detection.deviation)
        return detection.distance_to(self.x, self.y) <= allowed

    def add(self, detection: Detection) -> None:
        """Average with a detection; the better one of the two counts more."""
        mine, other = 1.0 / self.deviation**2, 1.0 / detection.deviation**2
        share = max(other / (mine + other), 0.2)  # objects may move
        self.x += share * (detection.position[0] - self.x)
        self.y += share * (detection.position[1] - self.y)
        self.deviation = max((mine + other) ** -0.5, 0.5 * detection.deviation)
        self.pictures, self.stamp = self.pictures + 1, detection.stamp


class ObjectWatch:
    """Collects the detections of a colour or label.

    Args:
        robot: asked for them.
        wanted: what is searched.
        silence: started timer; restarted by every picture or result of the detector.
    """

    def __init__(self, robot: Robot, wanted: WantedObject, silence: Timer) -> None:
        self._robot, self._wanted, self._silence = robot, wanted, silence
        self._candidates: list[SeenObject] = []
        self._newest = robot.time

    @property
    def is_blind(self) -> bool:
        """Whether no picture, or no result of the detector, has come for BLIND_TIME."""
        return self._silence.is_over(BLIND_TIME)

    def update(self) -> list[SeenObject]:
        """Ask for the newest picture's detections; return the confirmed objects, nearest first."""
        seen = self._coloured() if self._wanted.label is None else self._labelled()
        if seen is not None:
            self._silence.restart()
        for detection in seen or ():
            self._add(detection)
        here = self._robot.localisation.pose
        confirmed = [item for item in self._candidates if item.pictures >= CONFIRMATIONS]
        return sorted(confirmed, key=lambda item: hypot(item.x - here.x, item.y - here.y))

    def _coloured(self) -> Iterable[Detection] | None:
        """Return the detections of a new picture; None without one."""
        image = self._robot.perception.image()
        if image is None or image.stamp <= self._newest:
            return None
        self._newest = image.stamp
        return (
            self._robot.perception.coloured_objects(cast(ObjectColour, self._wanted.colour)) or ()
        )

    def _labelled(self) -> Iterable[Detection] | None:
        """Return what is new of the newest detections; None while there are none."""
        found = self._robot.perception.detections(self._wanted.label)
        if found is None:
            return None
        new = [item for item in found if item.stamp > self._newest]
        self._newest = max((item.stamp for item in new), default=self._newest)
        return new

    def _add(self, detection: Detection) -> None:
        self._candidates = [
            item for item in self._candidates
            if item.pictures >= CONFIRMATIONS or detection.stamp - item.stamp <= UNCONFIRMED_KEPT
        ]  # fmt: skip
        for item in self._candidates:
            if item.is_at(detection):
                if detection.stamp > item.stamp:
                    item.add(detection)
                return
        self._candidates.append(
            SeenObject(*detection.position, detection.deviation, 1, detection.stamp)
        )
