"""Keyframes: pictures from known poses, reduced to features with their positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from stack.perception.places.features import Descriptors, Features, detect, matches
from stack.perception.places.landmarks import landmarks
from stack.types import FloatArray, Image, Pose2D, wrap_angle

LEAST_LANDMARKS = 10
"""A picture with fewer is no keyframe."""

SAME_PLACE = 0.15
"""Metres within which two keyframes agree on the position of a feature."""

NEIGHBOURS, NEAR, ALIKE = 4, 2.5, 1.0
"""Keyframes that check another one: how many, within how many metres and radians."""


@dataclass(frozen=True, slots=True)
class Keyframe:
    """A picture from a known pose, reduced to its landmarks.

    Attributes:
        stamp: of the picture, seconds on the clock of the run that took it.
        pose: of the base, map frame.
        landmarks: (n, 3) base frame, metres.
        descriptors: (n, 128).
        whole: (d,) of the whole picture by a GlobalDescriptor; empty without one.
    """

    stamp: float
    pose: Pose2D
    landmarks: FloatArray
    descriptors: Descriptors
    whole: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, np.float32))

    @property
    def in_map(self) -> FloatArray:
        """(n, 3) landmarks in the map frame."""
        return np.column_stack([self.pose.transform(self.landmarks[:, :2]), self.landmarks[:, 2]])

    def kept(self, which: NDArray[np.bool_]) -> Keyframe:
        """Return the keyframe with some of its landmarks."""
        return replace(self, landmarks=self.landmarks[which], descriptors=self.descriptors[which])


def keyframe_of(image: Image, pose: Pose2D, points: FloatArray, most: int) -> Keyframe | None:
    """Return the keyframe of a picture; None with fewer than LEAST_LANDMARKS landmarks.

    Args:
        image: the picture.
        pose: of the base at the picture's stamp, map frame.
        points: (n, 2) of a range sensor at that time, base frame, metres.
        most: number of features.
    """
    features, positions = located(image, points, most)
    if len(positions) < LEAST_LANDMARKS:
        return None
    return Keyframe(image.stamp, pose, positions, features.descriptors)


def located(image: Image, points: FloatArray, most: int) -> tuple[Features, FloatArray]:
    """Return the features of a picture whose positions are known, and these; see `keyframe_of`.

    Features on the floor are left out, so that its texture takes no place of others.

    Returns:
        The features, strongest first, and (n, 3) positions, base frame, metres.
    """
    features = detect(image)
    positions = landmarks(features.pixels, image.camera, points)
    good = np.flatnonzero(np.isfinite(positions[:, 0]))[:most]
    return Features(features.pixels[good], features.descriptors[good]), positions[good]


def consistent(keyframes: Sequence[Keyframe]) -> list[Keyframe]:
    """Return the keyframes without the landmarks that most of their neighbours contradict.

    A neighbour that shows the same feature elsewhere contradicts it: the surface was not where the
    range sensor has put it, or the feature is on a pattern that repeats.
    """
    checked = []
    for index, keyframe in enumerate(keyframes):
        votes = np.zeros(len(keyframe.landmarks), dtype=np.int64)
        for other in _neighbours(index, keyframes):
            pairs = matches(keyframe.descriptors, other.descriptors)
            offset = keyframe.in_map[pairs[:, 0]] - other.in_map[pairs[:, 1]]
            agree = np.linalg.norm(offset, axis=1) <= SAME_PLACE
            votes[pairs[:, 0]] += np.where(agree, 1, -1)
        checked.append(keyframe.kept(votes >= 0))
    return checked


def _neighbours(index: int, keyframes: Sequence[Keyframe]) -> list[Keyframe]:
    """Return the nearest keyframes that look in about the same direction."""
    pose = keyframes[index].pose
    near = [
        (pose.distance_to(other.pose), number)
        for number, other in enumerate(keyframes)
        if number != index
        and pose.distance_to(other.pose) <= NEAR
        and abs(wrap_angle(other.pose.heading - pose.heading)) <= ALIKE
    ]
    return [keyframes[number] for _, number in sorted(near)[:NEIGHBOURS]]
