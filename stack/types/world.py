"""The robot's knowledge of its surroundings: markers, tracked objects, pose estimates."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, replace
from math import hypot

import numpy as np

from stack.types.geometry import FloatArray, Pose2D
from stack.types.sensors import NO_COVARIANCE

TRACK_PADDING = 0.12
"""Metres round a tracked object within which returns of range sensors belong to it."""


@dataclass(frozen=True, slots=True)
class TrackedObject:
    """A moving object that was tracked over several scans, map frame.

    Attributes:
        id: number, unique within a run.
        stamp: seconds on the robot's clock at which the other values apply.
        position: (x, y) of its centre, metres.
        velocity: (x, y), metres per second.
        radius: of its enclosing circle, metres.
        covariance: (4, 4) of position x, y and velocity x, y.
        label: `person` for a person, "" while it is not known what it is.
    """

    id: int
    stamp: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    radius: float
    covariance: FloatArray
    label: str = ""

    @property
    def speed(self) -> float:
        """Speed, metres per second."""
        return hypot(*self.velocity)

    def position_after(self, seconds: float) -> tuple[float, float]:
        """(x, y) of its centre after some seconds at constant velocity, metres."""
        return (
            self.position[0] + seconds * self.velocity[0],
            self.position[1] + seconds * self.velocity[1],
        )

    def at(self, time: float) -> TrackedObject:
        """The object extrapolated to another time at constant velocity; covariance unchanged."""
        if time == self.stamp:
            return self
        return replace(self, stamp=time, position=self.position_after(time - self.stamp))


@dataclass(frozen=True, slots=True)
class StandingObject(TrackedObject):
    """An object that is not on the map and has not moved: a thing, or a person who stands.

    Attributes:
        since: seconds; since when something is known to stand at this place, also out of sight.
    """

    since: float = 0.0


MARKER_DICTIONARIES = {
    **{f"DICT_{n}X{n}_{count}": count for n in (4, 5, 6, 7) for count in (50, 100, 250, 1000)},
    "DICT_ARUCO_ORIGINAL": 1024, "DICT_APRILTAG_16h5": 30, "DICT_APRILTAG_25h9": 35,
    "DICT_APRILTAG_36h10": 2320, "DICT_APRILTAG_36h11": 587,
}  # fmt: skip
"""OpenCV's fiducial dictionaries: name -> number of markers."""


@dataclass(frozen=True, slots=True)
class Marker:
    """A square fiducial marker of known size and pose, in the map frame.

    Attributes:
        number: its id in the dictionary.
        size: side of the black square, metres.
        position: (x, y, z) of the centre, metres.
        heading: direction of its outward normal, radians; the marker is vertical.
        dictionary: an OpenCV ArUco dictionary, e.g. DICT_4X4_50 or DICT_APRILTAG_36h11.
        position_deviation: standard deviation of x and y, metres; 0 where it is not known.
        heading_deviation: standard deviation of the heading, radians; likewise.
    """

    number: int
    size: float
    position: tuple[float, float, float]
    heading: float
    dictionary: str = "DICT_4X4_50"
    position_deviation: float = 0.0
    heading_deviation: float = 0.0


@dataclass(frozen=True, slots=True)
class HealthThresholds:
    """Limits of the localisation health, from the estimator's parameters.

    Attributes:
        lost: below it the robot counts as lost.
        good: from it on the pose counts as right.
    """

    lost: float = 0.3
    good: float = 0.5


@dataclass(frozen=True, slots=True)
class RivalPose:
    """Another pose that explains the measurements about as well as the estimate.

    Attributes:
        pose: of the base, map frame.
        share: its probability in [0, 1]; the estimate and all rivals add up to at most 1.
    """

    pose: Pose2D
    share: float


@dataclass(frozen=True, slots=True)
class View:
    """A place from which a scan tells rival poses apart.

    Attributes:
        motion: to it, current base frame; the same for all rivals.
        distance: metres of the way.
        gain: expected share of the ambiguity that a scan there resolves, in (0, 1].
    """

    motion: Pose2D
    distance: float
    gain: float


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """Estimate of the robot's pose.

    Attributes:
        pose: map frame.
        covariance: (3, 3) of x, y, heading.
        health: calibrated probability in [0, 1] that the pose is within 0.3 m and 10 degrees.
        map_from_odom: the odom frame's pose in the map frame.
        corrected_at: stamp of the newest measurement in `map_from_odom`, seconds.
        rivals: other poses that explain the measurements about as well, most probable first.
        thresholds: of the health.
        obscured: whether many beams end at unmapped things and hardly any passes a mapped wall: a
            low health then has a harmless cause.
    """

    pose: Pose2D
    covariance: FloatArray
    health: float
    map_from_odom: Pose2D = Pose2D(0.0, 0.0)
    corrected_at: float = 0.0
    _: KW_ONLY
    rivals: tuple[RivalPose, ...] = ()
    thresholds: HealthThresholds = HealthThresholds()
    obscured: bool = False

    def moved_to(self, pose: Pose2D) -> PoseEstimate:
        """Return the estimate at another pose, with nothing else changed."""
        return PoseEstimate(
            pose, self.covariance, self.health, self.map_from_odom, self.corrected_at,
            rivals=self.rivals, thresholds=self.thresholds, obscured=self.obscured,
        )  # fmt: skip

    @property
    def is_lost(self) -> bool:
        """Whether the scans fit neither the pose nor any rival: ambiguity alone is not LOST."""
        share = max(0.0, 1.0 - sum(rival.share for rival in self.rivals))
        return self.health < self.thresholds.lost * share

    @property
    def is_good(self) -> bool:
        """Whether the pose is probably right."""
        return self.health >= self.thresholds.good

    @property
    def ambiguous(self) -> bool:
        """Whether another pose explains the measurements about as well."""
        return bool(self.rivals)

    @property
    def position_deviation(self) -> float:
        """Standard deviation of the position in its most uncertain direction, metres."""
        return float(np.sqrt(max(0.0, np.linalg.eigvalsh(self.covariance[:2, :2])[-1])))

    @property
    def heading_deviation(self) -> float:
        """Standard deviation of the heading, radians."""
        return float(np.sqrt(max(0.0, self.covariance[2, 2])))


@dataclass(frozen=True, slots=True)
class PoseCandidate:
    """A pose of the robot that explains a marker sighting, with its error.

    Attributes:
        pose: of the base in the map frame, at the image's stamp.
        error: reprojection error, pixels.
        covariance: (3, 3) of x, y, heading, map frame; zeros where it is not known.
        share: its probability among the candidates of the picture, in [0, 1].
    """

    pose: Pose2D
    error: float
    covariance: FloatArray = field(default_factory=lambda: NO_COVARIANCE, compare=False)
    share: float = 1.0


@dataclass(frozen=True, slots=True)
class MarkerSighting:
    """A known marker detected in an image.

    Attributes:
        stamp: of the image, seconds.
        marker: the marker on the map.
        distance: from the camera, metres.
        candidates: both IPPE solutions, the better one first.
    """

    stamp: float
    marker: Marker
    distance: float
    candidates: tuple[PoseCandidate, ...]


@dataclass(frozen=True, slots=True)
class RelativePose:
    """A possible pose of one thing in the frame of another one, with its error.

    Attributes:
        pose: of a marker's centre and outward normal, base frame; or of the base, map frame.
        covariance: (3, 3) of x, y, heading; axes of the frame.
        share: its probability among the possible poses, in [0, 1].
    """

    pose: Pose2D
    covariance: FloatArray
    share: float = 1.0


@dataclass(frozen=True, slots=True)
class MarkerObservation:
    """A marker seen in a picture, relative to the base, for maps of markers.

    Attributes:
        stamp: of the picture, seconds.
        dictionary: its OpenCV dictionary.
        number: its id in the dictionary.
        size: side of its black square, metres.
        height: of its centre above the floor, metres.
        candidates: poses that explain its corners, the most probable first; their shares add up
            to 1.
    """

    stamp: float
    dictionary: str
    number: int
    size: float
    height: float
    candidates: tuple[RelativePose, ...]


@dataclass(frozen=True, slots=True)
class MarkerFix:
    """The base's pose by all known markers in one picture.

    Attributes:
        stamp: of the image, seconds.
        markers: those that explain it, the nearest first.
        candidates: poses that explain all of them, the most probable first: two where the markers
            are far away or in one plane, else one. Their shares add up to 1.
    """

    stamp: float
    markers: tuple[Marker, ...]
    candidates: tuple[PoseCandidate, ...]


@dataclass(frozen=True, slots=True)
class PlaceSighting:
    """A pose from which one picture looks as the keyframes of the map do.

    Attributes:
        stamp: of the picture, seconds on the body's clock.
        pose: of the base at the picture's stamp, map frame.
        inliers: features of the picture that agree on the pose.
        error: root mean square reprojection error of these features, pixels.
        deviation: standard deviation of the position in its least certain direction, metres.
        similarity: of the picture and the most similar keyframe, in [-1, 1].
    """

    stamp: float
    pose: Pose2D
    inliers: int
    error: float
    deviation: float
    similarity: float
