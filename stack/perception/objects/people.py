"""Which of the tracked moving objects are people: those that are tall."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from stack.types import PERSON, Detection, FloatArray, TrackedObject

AROUND = 0.05
"""Metres round a track's disc within which depth points are its own: more would be of walls."""

LOWEST, HIGHEST = 0.1, 2.3
"""Metres; depth points below are of the floor, above of the ceiling."""

LEAST_POINTS, TOP = 12, 98
"""Depth points that a track must have, and the percentile that is its height."""

SAME_PLACE, SIGMAS = 0.4, 2.0
"""Metres beyond the radius, and standard deviations, within which a detection shows a track."""


class PeopleFinder:
    """Remembers which tracks are people; a person who comes near is not seen to the full height."""

    def __init__(self) -> None:
        self.people: frozenset[int] = frozenset()

    def update(
        self, tracks: Sequence[TrackedObject], views: Iterable[tuple[float, FloatArray]],
        detections: Sequence[Detection], least_height: float,
    ) -> frozenset[int]:  # fmt: skip
        """Return the ids of the tracks that are people.

        Args:
            tracks: of moving objects, map frame.
            views: stamp and points (n, 3), map frame, of new depth pictures.
            detections: of a new camera picture.
            least_height: of a person, metres.
        """
        known = self.people & {track.id for track in tracks}
        unknown = [track for track in tracks if track.id not in known]
        if unknown:
            views = list(views)
            tall = [item for item in detections if _is_person(item, least_height)]
            known |= {
                track.id for track in unknown
                if any(height_of(track.at(at), points) >= least_height for at, points in views)
                or any(_shows(item, track) for item in tall)
            }  # fmt: skip
        self.people = known
        return known


def height_of(track: TrackedObject, points: FloatArray) -> float:
    """Return the height of what depth points (n, 3), map frame, show of a track; 0 if nothing."""
    if not len(points):
        return 0.0
    away = np.hypot(points[:, 0] - track.position[0], points[:, 1] - track.position[1])
    own = points[(away <= track.radius + AROUND), 2]
    own = own[(own > LOWEST) & (own < HIGHEST)]
    return float(np.percentile(own, TOP)) if len(own) >= LEAST_POINTS else 0.0


def _is_person(detection: Detection, least_height: float) -> bool:
    return detection.label == PERSON and detection.height >= least_height


def _shows(detection: Detection, track: TrackedObject) -> bool:
    x, y = track.at(detection.stamp).position
    reach = track.radius + SAME_PLACE + SIGMAS * detection.deviation
    return detection.distance_to(x, y) <= reach
