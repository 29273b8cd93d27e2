"""Where a coloured object is, from the detections of several pictures."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from behaviours.timer import Timer
from stack.robot import Robot
from stack.types import Detection, ObjectColour

CONFIRMED = 2
"""Pictures that must show an object at about the same place."""

SAME_PLACE, SIGMAS = 0.3, 3.0
"""Metres, and standard deviations, within which two detections are the same object."""

MEMORY = 10.0
"""Seconds after which an unconfirmed detection is forgotten."""

BLIND_TIME = 3.0
"""Seconds without a picture after which the camera counts as silent."""


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
    """Collects the detections of a colour.

    Args:
        robot: asked for them.
        colour: of the objects.
        silence: started timer; restarted by every picture.
    """

    def __init__(self, robot: Robot, colour: ObjectColour, silence: Timer) -> None:
        self._robot, self._colour, self._silence = robot, colour, silence
        self._started = robot.time
        self._candidates: list[SeenObject] = []
        self._newest = self._started

    @property
    def is_blind(self) -> bool:
        """Whether no picture has come for BLIND_TIME."""
        return self._silence.is_over(BLIND_TIME)

    def update(self) -> list[SeenObject]:
        """Ask for the newest picture's detections; return the confirmed objects, nearest first."""
        image = self._robot.image()
        if image is not None and image.stamp > self._newest:
            self._newest = image.stamp
            self._silence.restart()
            for detection in self._robot.coloured_objects(self._colour) or ():
                self._add(detection)
        here = self._robot.pose
        confirmed = [item for item in self._candidates if item.pictures >= CONFIRMED]
        return sorted(confirmed, key=lambda item: hypot(item.x - here.x, item.y - here.y))

    def _add(self, detection: Detection) -> None:
        self._candidates = [
            item for item in self._candidates
            if item.pictures >= CONFIRMED or detection.stamp - item.stamp <= MEMORY
        ]  # fmt: skip
        for item in self._candidates:
            if item.is_at(detection):
                if detection.stamp > item.stamp:
                    item.add(detection)
                return
        self._candidates.append(
            SeenObject(*detection.position, detection.deviation, 1, detection.stamp)
        )
