"""Drives past markers with drawn scans and drawn corners, without a simulation."""

from dataclasses import dataclass

import numpy as np

from stack.mapping.slam.mapper import Mapper
from stack.perception.markers.detector import MarkerDetection
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.stage import observed_marker
from stack.types import FloatArray, Image, Marker, MarkerObservation, Pose2D
from tests.stack.mapping.slam.rooms import scan_at
from tests.stack.perception.markers.marker_pictures import CAMERA, optical_from, seen_corners

NOISE, FARTHEST = 0.3, 3.0
"""Pixels; metres up to which the markers are seen."""

NOTHING = np.zeros((2, 2, 3), np.uint8)


@dataclass
class MarkerDrive:
    """Maps with odometry that drives too far to the east, and the markers that the camera sees.

    Attributes:
        mapper: gets scans and markers.
        walls: of the world.
        markers: that stand there.
        slip: metres too far for each metre driven to the east; it does not cancel out in a loop.
        errors: metres between estimate and truth at each scan.
    """

    mapper: Mapper
    walls: FloatArray
    markers: list[Marker]
    slip: float = 0.05

    def __post_init__(self) -> None:
        self.errors: list[float] = []
        self.odometry = Pose2D(3.0, -2.0, 0.7)

    def run(self, poses: list[Pose2D]) -> None:
        """Drive along the true poses, the first of which is known."""
        self.mapper.start(poses[0])
        for k, pose in enumerate(poses):
            if k:
                moved = pose.relative_to(poses[k - 1])
                scale = 1.0 + self.slip * (abs(pose.heading) < 0.5)
                ahead = Pose2D(scale * moved.x, moved.y, moved.heading)
                self.odometry = self.odometry.compose(ahead)
            found = self.mapper.add(0.1 * k, self.odometry, scan_at(self.walls, pose, 0.1 * k))
            self.errors.append(found.distance_to(pose))
            for marker in self.markers:
                seen = seen_marker(marker, pose, k)
                if seen is not None:
                    self.mapper.add_marker(seen, self.odometry)


def seen_marker(
    marker: Marker, pose: Pose2D, step: int, stamp: float = 0.0
) -> MarkerObservation | None:
    """The marker as the camera sees it, with noisy corners; None if it is out of view."""
    centre = optical_from(pose, CAMERA) @ np.array([*marker.position, 1.0])
    in_view = 0.3 < centre[2] < FARTHEST and abs(centre[0]) < 0.6 * centre[2]
    base = Pose2D(marker.position[0], marker.position[1], marker.heading).inverse().compose(pose)
    if not in_view or base.x < 0.3:
        return None
    corners = seen_corners(pose, marker, CAMERA)
    generator = np.random.default_rng([step, marker.number])
    corners = corners + generator.normal(0.0, NOISE, corners.shape)
    found = MarkerDetection(marker.dictionary, marker.number, corners)
    return observed_marker(found, Image(stamp, NOTHING, CAMERA), MarkerParameters())
