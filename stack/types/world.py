"""What the robot knows of its surroundings: markers, tracked objects, its own pose."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from stack.types.geometry import FloatArray, Pose2D


@dataclass(frozen=True, slots=True)
class TrackedObject:
    """A moving thing that was followed over several scans, map frame.

    Attributes:
        id: number, never used again in a run.
        stamp: seconds on the robot's clock for which the rest holds.
        position: (x, y) of its middle, metres.
        velocity: (x, y), metres per second.
        radius: of the circle that it fits in, metres.
        covariance: (4, 4) of position x, y and velocity x, y.
    """

    id: int
    stamp: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    radius: float
    covariance: FloatArray

    @property
    def speed(self) -> float:
        """Metres per second."""
        return hypot(*self.velocity)

    def position_after(self, seconds: float) -> tuple[float, float]:
        """Where its middle will be if it keeps its velocity, metres."""
        return (
            self.position[0] + seconds * self.velocity[0],
            self.position[1] + seconds * self.velocity[1],
        )

    def at(self, time: float) -> TrackedObject:
        """The same thing at another time, where it keeps its velocity; covariance as it was."""
        return replace(self, stamp=time, position=self.position_after(time - self.stamp))


@dataclass(frozen=True, slots=True)
class Marker:
    """A square fiducial of known size at a known place, in the map frame.

    Attributes:
        number: its id in the dictionary.
        size: side of the black square, metres.
        position: (x, y, z) of the middle, metres.
        heading: direction in which it faces (its outward normal), radians; it stands upright.
        dictionary: an OpenCV ArUco dictionary, e.g. DICT_4X4_50 or DICT_APRILTAG_36h11.
    """

    number: int
    size: float
    position: tuple[float, float, float]
    heading: float
    dictionary: str = "DICT_4X4_50"


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """Where the robot believes it is.

    Attributes:
        pose: map frame.
        covariance: (3, 3) of x, y, heading.
        health: in [0, 1]; how well the scans fit the map here. Below 0.3 something is wrong.
    """

    pose: Pose2D
    covariance: FloatArray
    health: float

    @property
    def position_deviation(self) -> float:
        """Standard deviation of the position along its worst direction, metres."""
        return float(np.sqrt(max(0.0, np.linalg.eigvalsh(self.covariance[:2, :2])[-1])))

    @property
    def heading_deviation(self) -> float:
        """Standard deviation of the heading, radians."""
        return float(np.sqrt(max(0.0, self.covariance[2, 2])))


@dataclass(frozen=True, slots=True)
class PoseCandidate:
    """A pose of the robot that a marker sighting would explain, and how badly it fits.

    Attributes:
        pose: of the base in the map frame, at the image's stamp.
        error: reprojection error, pixels.
    """

    pose: Pose2D
    error: float


@dataclass(frozen=True, slots=True)
class MarkerSighting:
    """A known marker seen in an image; both IPPE solutions, better first."""

    stamp: float
    marker: Marker
    distance: float
    candidates: tuple[PoseCandidate, ...]
