"""Recognition of places: retrieval of keyframes, geometric verification, a pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stack.perception.places.descriptor import GlobalDescriptor
from stack.perception.places.features import Descriptors, Features, matches
from stack.perception.places.keyframes import Keyframe, consistent, located
from stack.perception.places.parameters import PlaceParameters
from stack.perception.places.verification import refined, verified
from stack.perception.places.vocabulary import Vocabulary, trained
from stack.types import FloatArray, Image, PlaceSighting, Pose2D, wrap_angle

FEATURES = 400
"""Most features that are taken of a picture."""
LARGEST_ERROR = 4.0
"""Largest reprojection error of a feature that agrees on a pose, px."""

LEAST_KEYFRAMES = 3
"""With fewer there is nothing to train a vocabulary with."""

SAME_HEIGHT = 0.15
"""Metres by which the heights of the same feature differ in two pictures at most."""

SAME_POSITION, SAME_SHARE = 0.1, 0.05
"""Metres, and share of its distance, by which a feature is off its landmark at most."""

SAME_PIXEL = 3.0
"""Pixels; features that are closer count once: a corner has several orientations and scales."""

SAME_DISTANCE, SAME_ANGLE = 0.5, 0.2
"""Metres and radians within which two poses are the same."""


class PlaceRecogniser:
    """Recognises where a picture was taken by the keyframes of a map."""

    def __init__(
        self, keyframes: Sequence[Keyframe], parameters: PlaceParameters,
        vocabulary: Vocabulary | None = None, descriptor: GlobalDescriptor | None = None,
    ) -> None:  # fmt: skip
        """Prepare the search.

        Args:
            keyframes: of the map; at least LEAST_KEYFRAMES.
            parameters: what is accepted.
            vocabulary: of saved keyframes; None: train it and drop inconsistent landmarks.
            descriptor: retrieves the keyframes, all of which have its vector; None: VLAD does.
        """
        self.parameters = parameters
        self.keyframes = list(keyframes) if vocabulary is not None else consistent(keyframes)
        self.vocabulary = vocabulary or trained([one.descriptors for one in self.keyframes])
        self._descriptor = descriptor
        if descriptor is None:
            rows = [self.vocabulary.describe(one.descriptors) for one in self.keyframes]
        else:
            rows = [one.whole.astype(np.float64) for one in self.keyframes]
        self._rows: FloatArray = np.array(rows)

    def recognise(self, image: Image, points: FloatArray) -> tuple[PlaceSighting, ...]:
        """Return the poses from which the picture can have been taken, most inliers first.

        Args:
            image: the picture.
            points: (n, 2) of a range sensor at its time, base frame, metres.
        """
        features, positions = located(image, points, FEATURES)
        if not len(features.pixels):
            return ()
        similarity = (self._rows * self._described(image, features)).sum(axis=1)
        retrieved = np.argsort(-similarity, kind="stable")[: self.parameters.candidates]
        pairs = [
            self._pairs(features.descriptors, positions[:, 2], int(index)) for index in retrieved
        ]
        numbers = np.concatenate([own for own, _ in pairs])
        landmarks = np.concatenate([known for _, known in pairs])
        found: list[tuple[Pose2D, PlaceSighting]] = []
        pooled = _Pool(features.pixels[numbers], positions[numbers], landmarks)
        for own, known in pairs:
            start = verified(features.pixels[own], known, image.camera, LARGEST_ERROR)
            if start is None or any(_same(start.pose, pose) for pose, _ in found):
                continue
            sighting = pooled.sighting(start.pose, image, float(similarity[retrieved[0]]))
            if sighting is not None:
                found.append((start.pose, sighting))
        return _distinct([sighting for _, sighting in found if self._is_accepted(sighting)])

    def _described(self, image: Image, features: Features) -> FloatArray:
        """Return the vector of a picture for the retrieval."""
        if self._descriptor is not None:
            return self._descriptor.describe(image.pixels)
        return self.vocabulary.describe(features.descriptors)

    def _pairs(
        self, descriptors: Descriptors, heights: FloatArray, index: int
    ) -> tuple[NDArray[np.intp], FloatArray]:
        """Return the numbers of features, and the landmarks (n, 3) of a keyframe they belong to."""
        keyframe = self.keyframes[index]
        pairs = matches(descriptors, keyframe.descriptors)
        off = heights[pairs[:, 0]] - keyframe.landmarks[pairs[:, 1], 2]
        pairs = pairs[np.abs(off) <= SAME_HEIGHT]
        return pairs[:, 0], keyframe.in_map[pairs[:, 1]]

    def _is_accepted(self, sighting: PlaceSighting) -> bool:
        p = self.parameters
        return sighting.inliers >= p.least_inliers and sighting.deviation <= p.largest_deviation


@dataclass(frozen=True, slots=True)
class _Pool:
    """The pairs of all retrieved keyframes.

    Attributes:
        pixels: (n, 2) of the features.
        positions: (n, 3) of the features, base frame, metres.
        landmarks: (n, 3) of the landmarks, map frame, metres.
    """

    pixels: FloatArray
    positions: FloatArray
    landmarks: FloatArray

    def sighting(self, start: Pose2D, image: Image, similarity: float) -> PlaceSighting | None:
        """Return the pose near `start` on which the pairs agree, in the picture and in space.

        Patterns that repeat agree in the picture at wrong poses, but then most of their features
        are at another distance than the range sensor measures.
        """
        camera = image.camera
        found = refined(start, self.pixels, self.landmarks, camera, LARGEST_ERROR)
        if found is None:
            return None
        ahead = found.pose.inverse().transform(self.landmarks[:, :2])
        off = np.linalg.norm(ahead - self.positions[:, :2], axis=1)
        limit = SAME_POSITION + SAME_SHARE * np.linalg.norm(self.positions[:, :2], axis=1)
        agree = found.inliers & (off <= limit)
        if 2 * agree.sum() < found.inliers.sum():
            return None
        inliers = len(np.unique(np.floor(self.pixels[agree] / SAME_PIXEL), axis=0))
        return PlaceSighting(
            image.stamp, found.pose, inliers, found.error, found.deviation, similarity
        )


def _distinct(sightings: list[PlaceSighting]) -> tuple[PlaceSighting, ...]:
    """Return the best of the sightings with the same pose, most inliers first."""
    kept: list[PlaceSighting] = []
    for sighting in sorted(sightings, key=lambda one: (-one.inliers, one.error)):
        if not any(_same(sighting.pose, other.pose) for other in kept):
            kept.append(sighting)
    return tuple(kept)


def _same(one: Pose2D, other: Pose2D) -> bool:
    turn = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) <= SAME_DISTANCE and turn <= SAME_ANGLE
