"""Scans and points without the returns of people."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stack.perception.tracking.people_mask import AROUND, points_beside, without_objects
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


PLACES = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


@given(st.lists(PLACES, max_size=20), st.lists(PLACES, max_size=4), st.floats(0.1, 0.5))
def test_points_stay_if_they_are_off_everybody(places, people, radius):
    points = np.array(places, dtype=np.float64).reshape(-1, 2)
    objects = [TrackedObject(n, 0.0, at, (0.0, 0.0), radius, np.eye(4))
               for n, at in enumerate(people)]  # fmt: skip
    left = points_beside(points, POSE, objects)
    away = [
        [np.hypot(*(there - item.position)) - radius - AROUND for item in objects]
        for there in POSE.transform(points)
    ]
    expected = [all(gap > 0.0 for gap in row) for row in away]
    clear = [all(abs(gap) > 1e-9 for gap in row) for row in away]  # rounding decides otherwise
    if all(clear):
        assert left.tolist() == points[np.array(expected, dtype=bool)].tolist()
