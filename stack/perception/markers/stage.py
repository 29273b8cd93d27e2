"""The markers' stage of the step loop: poses by known markers, and the survey of unknown ones."""

from __future__ import annotations

from stack.frames.buffer import TransformBuffer
from stack.perception.markers.detector import MarkerDetection, MarkerDetector
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.relative_pose import relative_poses
from stack.perception.markers.survey import LEAST_SIDE, MarkerSurvey
from stack.types import (
    Image,
    MarkerFix,
    MarkerObservation,
    Observation,
    Pose2D,
    PoseEstimate,
    wrap_angle,
)

_ROUNDING = 1e-9


class MarkerStage:
    """Searches new pictures for markers while localisation or survey use them.

    Args:
        detector: None when the robot has no camera; the stage then does nothing.
        parameters: what it does, and how often.

    Attributes:
        detector: as given.
        survey: of the markers that the map does not have.
        fixes: number of pictures that gave a pose so far.
    """

    def __init__(self, detector: MarkerDetector | None, parameters: MarkerParameters) -> None:
        self.parameters, self.detector = parameters, detector
        self.survey = MarkerSurvey(parameters)
        self.fixes = 0
        self._last = float("-inf")
        self._fixed_at: Pose2D | None = None

    def configure(self, parameters: MarkerParameters) -> None:
        """Apply new parameters to the next pictures."""
        self.parameters = parameters
        self.survey.configure(parameters)
        if self.detector is not None:
            self.detector.configure(parameters)

    @property
    def is_on(self) -> bool:
        """Whether pictures are searched."""
        used = self.parameters.localise or self.parameters.survey
        return used and self.detector is not None

    def wants_picture(self, now: float) -> bool:
        """Return whether the camera should take a picture now."""
        due = self._last + 1.0 / self.parameters.rate
        return self.is_on and now >= due - _ROUNDING

    def update(self, observation: Observation, frames: TransformBuffer) -> MarkerFix | None:
        """Return the base's pose by the known markers in a new picture.

        None without a new picture or known markers in it, and while the robot has hardly moved
        since the last one.

        Args:
            observation: new measurements.
            frames: with the odometry up to the observation's time.
        """
        image = self._picture(observation)
        if image is None or self.detector is None:
            return None
        self._last = image.stamp
        if not self.parameters.localise or not frames.covers(image.stamp):
            return None
        odometry = frames.pose_at("odom", image.stamp)
        if not self._has_moved(odometry):
            return None
        fix = self.detector.fix(image)
        if fix is not None:
            self._fixed_at = odometry
            self.fixes += 1
        return fix

    def add_views(
        self, observation: Observation, frames: TransformBuffer, estimate: PoseEstimate
    ) -> None:
        """Add the unknown markers in a new picture to the survey, while it is on.

        Args:
            observation: new measurements.
            frames: with the estimate of this step.
            estimate: of this step; a pose that is not good adds nothing.
        """
        image = self._picture(observation)
        if image is None or self.detector is None or not self.parameters.survey:
            return
        if not frames.covers(image.stamp) or not estimate.is_good or estimate.ambiguous:
            return
        pose, odometry = frames.pose_at("map", image.stamp), frames.pose_at("odom", image.stamp)
        for found in self.detector.unknown(image):
            self.survey.add(found, image, pose, estimate.covariance, odometry)

    def observed(self, observation: Observation) -> tuple[MarkerObservation, ...]:
        """Return the markers to survey in a new picture, relative to the base; none without one.

        These are the unknown ones, and those that an earlier survey has put on the map. Markers
        that appear too small are left out: their corners are biased.
        """
        image = self._picture(observation)
        if image is None or self.detector is None or not self.parameters.survey:
            return ()
        return tuple(
            seen
            for found in self.detector.uncertain(image)
            if found.dictionary == self.parameters.surveyed_dictionary and found.side >= LEAST_SIDE
            and (seen := observed_marker(found, image, self.parameters)) is not None
        )  # fmt: skip

    def _picture(self, observation: Observation) -> Image | None:
        return next(iter(observation.of(Image).values()), None) if self.is_on else None

    def _has_moved(self, odometry: Pose2D) -> bool:
        before, p = self._fixed_at, self.parameters
        if before is None:
            return True
        turn = abs(wrap_angle(odometry.heading - before.heading))
        return odometry.distance_to(before) >= p.update_distance or turn >= p.update_angle


def observed_marker(
    found: MarkerDetection, image: Image, parameters: MarkerParameters
) -> MarkerObservation | None:
    """Return a surveyed marker in an image relative to the base; None if it stands not upright."""
    size = parameters.surveyed_size
    seen = relative_poses(size, image.camera, found.corners, parameters)
    if seen is None:
        return None
    height, candidates = seen
    return MarkerObservation(
        image.stamp, found.dictionary, found.number, size, height, candidates
    )  # fmt: skip
