"""Measurements without the returns of people."""

from math import cos, pi, sin

import numpy as np
import pytest

from stack.perception.tracking.people_mask import is_echo_of, without_objects
from stack.types import TRACK_PADDING, Pose2D, RangeReading, Scan, TrackedObject

POSE = Pose2D(1.0, 2.0, 0.5)


def scan(ranges) -> Scan:
    values = np.array(ranges, dtype=np.float32)
    return Scan(0.0, values, 0.0, 2 * np.pi / len(values), 0.05, 12.0, Pose2D(0.1, 0.0))


def test_only_beams_that_end_at_the_object_become_invalid():
    """Four beams of 2 m from (1.1 m ahead of the base); the object is where the first one ends."""
    seen = scan([2.0, 2.0, np.inf, 2.0])
    end = POSE.compose(Pose2D(2.1, 0.0))
    walker = TrackedObject(1, 0.0, (end.x + 0.2, end.y), (1.0, 0.0), 0.2, np.eye(4))
    masked = without_objects(seen, POSE, [walker])
    assert np.isnan(masked.ranges).tolist() == [True, False, False, False]
    assert masked.ranges[1:].tolist() == seen.ranges[1:].tolist()
    assert seen.ranges[0] == 2.0


def test_the_scan_is_the_same_where_nobody_is():
    seen = scan([2.0, 2.0, np.inf, 2.0])
    far = TrackedObject(1, 0.0, (9.0, 9.0), (1.0, 0.0), 0.2, np.eye(4))
    assert without_objects(seen, POSE, []) is seen
    assert without_objects(seen, POSE, [far]) is seen
    assert TRACK_PADDING < 0.2


@pytest.mark.parametrize(
    ("distance", "bearing", "echo"),
    [
        (1.0, 0.0, True),
        (1.1, 0.0, True),  # within 12 cm
        (1.2, 0.0, False),
        (0.8, 0.0, False),
        # half the cone, 15 deg, and asin((0.25 + 0.12) / 1.25) = 17.2 deg: together 32.2 deg
        (1.0, 32.0, True),
        (1.0, 32.5, False),
        (1.0, 180.0, False),
    ],
)
def test_a_reading_is_an_echo_of_whose_surface_is_in_its_cone_at_its_distance(
    distance, bearing, echo
):
    """The person's middle is 1.25 m from the sonar, their surface 1 m."""
    mount = Pose2D(0.2, 0.1, 0.3)
    reading = RangeReading(0.0, distance, pi / 6, 0.05, 2.5, mount, "front")
    sensor = POSE.compose(mount)
    way = sensor.heading + np.radians(bearing)
    there = (sensor.x + 1.25 * cos(way), sensor.y + 1.25 * sin(way))
    walker = TrackedObject(1, 0.0, there, (1.0, 0.0), 0.25, np.eye(4))
    assert is_echo_of(reading, POSE, [walker]) is echo
    assert not is_echo_of(reading, POSE, [])
