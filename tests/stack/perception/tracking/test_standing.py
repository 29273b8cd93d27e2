"""Places where something stands, seen from scans in closed form."""

from math import inf

import numpy as np
import pytest

from stack.perception.tracking.parameters import TrackerParameters
from stack.perception.tracking.standing import StandingPlaces
from stack.perception.tracking.tracker import Tracker
from stack.perception.tracking.view import View
from stack.types import Pose2D
from tests.stack.perception.tracking.test_tracker import MOUNT, follow, seen

HERE = Pose2D(0.0, 0.0)
BIN = (3.0, 1.0, 0.2)


def view_of(*circles, pose=HERE):
    return View(pose.compose(MOUNT), seen(pose, circles))


def test_a_place_keeps_the_time_of_its_first_view():
    places = StandingPlaces()
    places.note(np.array([[3.0, 1.0, 0.2]]), 4.0)
    places.note(np.array([[3.1, 1.2, 0.2]]), 9.0)  # 0.22 m from there: the same thing
    assert len(places) == 1
    assert places.since(3.0, 1.4) == 4.0  # 0.22 m from the newer centre
    places.note(np.array([[3.0, 2.0, 0.2], [3.1, 1.2, 0.2]]), 9.5)
    assert (len(places), places.since(3.0, 2.0), places.since(3.1, 1.2)) == (2, 9.5, 4.0)
    assert places.since(5.0, 1.0) == inf


def test_what_moves_off_is_forgotten():
    places = StandingPlaces()
    places.note(np.array([[3.0, 1.0, 0.2]]), 4.0)
    places.forget(3.1, 1.0)
    assert len(places) == 0 and places.since(3.0, 1.0) == inf


@pytest.mark.parametrize(
    ("circles", "kept"),
    [
        ([BIN], True),
        ([(1.5, 0.5, 0.3)], True),  # hidden behind something
        ([(3.6, 1.2, 0.3)], False),  # its place is free before what is behind it
    ],
)
def test_a_place_is_remembered_until_two_scans_in_a_row_see_through_it(circles, kept):
    places = StandingPlaces()
    places.note(np.array([BIN]), 4.0)
    places.look(view_of(*circles))
    assert len(places) == 1
    places.look(view_of(BIN))  # the two scans are not in a row
    places.look(view_of(*circles))
    assert len(places) == 1
    places.look(view_of(*circles))
    assert (len(places) == 1) is kept


def test_standing_objects_keep_their_time_while_they_are_hidden():
    tracker = Tracker(TrackerParameters())
    assert follow(tracker, lambda time: [BIN], 1.0) == ()
    (item,) = tracker.standing
    assert item.since == pytest.approx(0.2)  # three detections at 10 Hz
    for step in range(30):  # behind something for 3 s; tracks are forgotten after 1 s
        tracker.update(HERE, seen(HERE, [(1.5, 0.5, 0.3)]), 1.1 + 0.1 * step)
    for step in range(5):
        tracker.update(HERE, seen(HERE, [BIN]), 4.2 + 0.1 * step)
    (again,) = tracker.standing
    assert again.id != item.id and again.since == item.since


POST = (1.7, 0.0, 0.15)


def test_who_walks_off_leaves_no_place():
    tracker = Tracker(TrackerParameters())  # towards the robot: they hide where they have stood
    follow(tracker, lambda time: [(4.0 - max(time - 1.0, 0.0), 0.0, 0.2)], 2.0)
    assert len(tracker._places) == 0 and tracker.standing == ()


def walk(time):
    """North at 1 m/s, past a post that hides what stands behind it; out of sight from 1.05 s on."""
    return [(3.0, -1.5 + time, 0.2), POST] if time < 1.05 else [POST]


@pytest.mark.parametrize("scans", [1, 5])
@pytest.mark.parametrize(("remembered", "taken"), [(True, False), (False, True)])
def test_a_lost_object_is_not_what_has_stood_there_before(scans, remembered, taken):
    # The bin is 0.5 m from where the object is expected at 1.2 s, and of its size. After more scans
    # out of sight, it is inside the gate.
    tracker, bin_ = Tracker(TrackerParameters()), (3.4, 0.0, 0.2)
    if remembered:
        for step in range(30):
            tracker.update(HERE, seen(HERE, [bin_] if step < 6 else [POST]), -3.0 + 0.1 * step)
    time = 1.0 + 0.1 * scans
    (walker,) = follow(tracker, walk, time)
    tracks = tracker.update(HERE, seen(HERE, [bin_]), time + 0.1)
    (same,) = [item for item in tracks if item.id == walker.id]
    assert (same.position[0] > 3.2) is taken
