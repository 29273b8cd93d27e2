"""Scans without the returns of people."""

import numpy as np

from stack.perception.tracking.people_mask import AROUND, without_objects
from stack.types import Pose2D, Scan, TrackedObject

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
    assert AROUND < 0.2
