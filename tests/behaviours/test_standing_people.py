"""follow_person and people who stand: they have no track, since tracks are of what moves."""

from math import hypot, pi

import numpy as np
import pytest
from py_trees.common import Status

from behaviours._people.followed_person import FollowedPerson
from behaviours.following.follow_person import FollowPerson
from behaviours.testing import tick
from stack.types import FailureCode, Pose2D
from tests.behaviours.walking_people import THING, Escort, standing, track

FRONT = 0.22 / np.cos(pi / 16)
PERSON = 0.2


def lost_person():
    """A person who walked east at 0.8 m/s from the origin and was last seen at (0.8, 0) at 1 s."""
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    for n in range(1, 11):
        person.update([track(1, (0.08 * n, 0.0), (0.8, 0.0))], 0.1 * n)
    person.update([], 2.0)
    assert not person.visible
    return person


def test_who_stands_on_the_persons_way_is_the_person_and_keeps_the_number():
    person = lost_person()
    person.update([], 2.1, [standing(7, (1.4, 0.3), 1.8)])
    assert (person.seen.id, person.visible, person.is_supposed) == (7, True, True)
    assert (person.stands, person.times_lost) == (True, 1)
    person.update([track(7, (1.5, 0.7), (0.0, 0.8))], 2.7)
    assert (person.seen.id, person.visible, person.is_supposed) == (7, True, False)


def test_what_stood_there_while_the_person_was_in_sight_is_not():
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    thing = standing(7, (1.4, 0.3), 0.1)
    person.update([track(1, (0.08, 0.0), (0.8, 0.0))], 0.1, [thing])
    # Out of sight for a second, it has another number, and is seen 0.3 m from there.
    person.update([], 2.0, [standing(8, (1.2, 0.5), 1.9)])
    assert not person.visible


def test_what_stood_there_before_the_person_was_followed_is_not():
    person = lost_person()
    person.update([], 2.1, [standing(7, (1.4, 0.3), -5.0)])
    assert not person.visible


def test_who_stands_where_the_person_is_more_likely_is():
    person = lost_person()
    person.update([], 2.1, [standing(7, (1.4, 0.9), 1.8)])  # costs 0.4 + 0.9 m
    person.update([], 2.2, [standing(7, (1.4, 0.9), 1.8), standing(8, (1.9, 0.2), 2.2)])
    assert person.seen.id == 8
    person.update([], 2.3, [standing(7, (1.4, 0.9), 1.8), standing(8, (1.9, 0.2), 2.2)])
    assert person.seen.id == 8


def test_what_has_another_size_is_not():
    person = lost_person()
    for radius in (0.05, 0.32):  # the person's is 0.2, and 0.1 is allowed
        person.update([], 2.1, [standing(7, (1.4, 0.0), 1.8, radius)])
        assert not person.visible
    person.update([], 2.1, [standing(7, (1.4, 0.0), 1.8, 0.28)])
    assert person.visible


def test_what_is_far_from_the_persons_way_is_not_yet():
    # reach 0.8 + 0.8 t = cost 0.4 + 2.0 after 2.0 s out of sight
    person = lost_person()
    for n in range(21, 60):
        person.update([], 0.1 * n, [standing(7, (1.4, 2.0), 1.8)])
        if person.visible:
            break
    assert person.seen.stamp == pytest.approx(1.0 + 2.0, abs=0.11)


def test_who_stands_where_somebody_else_is_expected_is_not():
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    other = track(2, (1.6, 1.4), (0.0, -0.8))
    person.update([track(1, (0.08, 0.0), (0.8, 0.0)), other], 0.1)
    person.update([], 2.0, [standing(7, (1.6, 0.4), 1.8)])  # number 2: expected at (1.6, 0.2)
    assert not person.visible


def test_somebody_who_walks_where_the_person_is_more_likely_is():
    person = lost_person()
    person.update([], 2.1, [standing(7, (1.4, 0.7), 1.8)])  # costs 0.4 + 0.7 m
    assert person.is_supposed
    # expected at 0.8 + 0.8 · 1.5 = 2.0 m: costs 0.9 m and is found
    person.update([track(8, (2.0, 0.9), (0.8, 0.0))], 2.5, [standing(7, (1.4, 0.7), 1.8)])
    assert (person.seen.id, person.is_supposed) == (8, False)


def test_somebody_who_walks_where_the_person_is_less_likely_is_not():
    person = lost_person()
    person.update([], 2.1, [standing(7, (1.4, 0.3), 1.8)])  # costs 0.4 + 0.3 m
    person.update([track(8, (2.0, 0.9), (0.8, 0.0))], 2.5, [standing(7, (1.4, 0.3), 1.8)])
    assert (person.seen.id, person.is_supposed) == (7, True)


def test_nobody_walks_farther_than_people_can():
    # In 2.5 s a person of 0.8 m/s comes 0.8 + 1.3 · 0.8 · 2.5 = 3.4 m.
    person = lost_person()
    person.update([track(8, (4.4, 0.0), (0.8, 0.0))], 3.5)  # 2.4 m from the expected place
    assert not person.visible
    person.update([track(9, (4.1, 0.0), (0.8, 0.0))], 3.5)
    assert person.visible


def jumped():
    """The person walks east at 0.8 m/s to (0.8, 0) at 1 s; then their track is at (0.9, 0.9)."""
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    for n in range(1, 11):
        person.update([track(1, (0.08 * n, 0.0), (0.8, 0.0))], 0.1 * n)
    person.update([track(1, (0.9, 0.9), (0.0, 0.5))], 1.1)
    assert (person.seen.id, person.is_supposed) == (1, True)
    return person


def test_a_track_that_jumps_to_a_thing_is_given_up_for_who_stands_on_the_way():
    person = jumped()
    person.update([track(1, (0.9, 0.9))], 1.2, [standing(7, (1.1, 0.1), 1.2)])
    assert (person.seen.id, person.is_supposed) == (7, True)
    person.update([track(1, (0.9, 0.9))], 1.3, [standing(7, (1.1, 0.1), 1.2)])
    assert person.seen.id == 7  # number 1 is somebody else now


def test_a_track_that_jumps_and_walks_on_is_the_person():
    person = jumped()
    for n in range(1, 7):  # 0.4 m at 0.8 m/s: after 5 steps
        person.update([track(1, (0.9 + 0.08 * n, 0.9), (0.8, 0.0))], 1.1 + 0.1 * n)
    assert not person.is_supposed
    person.update([track(1, (1.46, 0.9), (0.8, 0.0))], 1.8, [standing(7, (1.1, 0.1), 1.8)])
    assert person.seen.id == 1


def test_a_step_aside_is_no_jump():
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    follow_up = track(1, (0.08, 0.45), (0.8, 0.0))  # 0.45 m from the expected place
    person.update([follow_up], 0.1)
    assert not person.is_supposed


def corner_hides(pose, at):
    """A wall along y = 0.6 up to x = 4: what is beyond is seen only from near its end."""
    return at[1] > 0.6 and pose.x < 3.6


def stops_behind_the_corner(time):
    along = 2.0 + 1.0 * time
    return (along, 0.0) if along < 5.0 else (5.0, min(along - 5.0, 1.5))


def test_it_finds_somebody_who_has_stopped_behind_a_corner():
    robot = Escort(walks=[stops_behind_the_corner], hides=corner_hides, corner=(4.8, 0.0))
    behaviour = FollowPerson(until_stands=3.0)
    assert tick(behaviour, robot, 20.0) is Status.SUCCESS
    assert not robot.tracks  # nobody has seen them move there
    assert (behaviour.person.x, behaviour.person.y) == pytest.approx((5.0, 1.5), abs=0.1)
    assert behaviour.gap == pytest.approx(1.0, abs=0.4)
    # to x = 3.6 at 0.8 m/s: 4.5 s; the distance is nearly kept there, and then they stand 3 s
    assert robot.time < 12.0


def test_it_passes_by_a_bin_that_it_has_seen_before():
    """The bin stands beside the way of the person, where they go out of sight."""
    robot = Escort(
        walks=[stops_behind_the_corner], hides=corner_hides, corner=(4.8, 0.0),
        things=[(5.3, 0.5, PERSON)],
    )  # fmt: skip
    behaviour = FollowPerson(until_stands=3.0)
    assert tick(behaviour, robot, 20.0) is Status.SUCCESS
    assert (behaviour.person.x, behaviour.person.y) == pytest.approx((5.0, 1.5), abs=0.1)


def test_what_never_moves_is_given_up_after_the_patience():
    robot = Escort(walks=[lambda time: (2.0 + 0.5 * time, 0.0)])
    robot.hides = lambda pose, at: robot.time > 4.0 if at[1] == 0.0 else robot.time < 4.5
    robot.things = [(4.6, 0.3, PERSON)]
    behaviour = FollowPerson(patience=10.0)
    assert tick(behaviour, robot, 40.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.PERSON_LOST
    assert behaviour.failure.sentence == (
        "what stands at (4.6, 0.3), where the person may be, has not moved for 10 s"
    )


def test_it_follows_somebody_who_stands_at_the_given_place():
    def leaves(time):
        return 3.0 + 0.5 * max(time - 6.0, 0.0), 0.0

    robot = Escort(
        walks=[leaves], unmoved={1}, things=[(2.4, 0.1, PERSON), (3.0, 0.1, 0.5)]
    )  # 0.6 m from the place, and larger than a person
    behaviour = FollowPerson(near=Pose2D(3.0, 0.1), until_time=14.0)
    assert tick(behaviour, robot, 3.0) is Status.RUNNING
    assert (behaviour.person.x, behaviour.person.y) == (3.0, 0.0)
    assert robot.calls_of("follow_path")  # it has come nearer before they leave
    assert tick(behaviour, robot, 20.0) is Status.SUCCESS
    assert behaviour.person.x == pytest.approx(leaves(14.0)[0], abs=0.1)
    assert behaviour.times_lost == 0


def test_a_bin_ahead_is_nobody_to_follow():
    robot = Escort(walks=[], things=[(2.0, 0.0, PERSON)])
    behaviour = FollowPerson(patience=2.0)
    assert tick(behaviour, robot, 5.0) is Status.FAILURE
    assert behaviour.failure.sentence == "no walking person ahead within 2 s"


def test_a_plan_to_somebody_who_stands_ends_beside_them():
    # The costmap shows them as an obstacle: the robot's outline must keep off theirs.
    robot = Escort(walks=[lambda time: (4.0, 3.0)], unmoved={1})
    behaviour = FollowPerson(near=Pose2D(4.0, 3.0))
    tick(behaviour, robot, 0.3)
    goal = robot.calls_of("plan")[0]["goal"]
    assert hypot(goal.x - 4.0, goal.y - 3.0) == pytest.approx(FRONT + PERSON + 0.2)
    assert goal.y / goal.x == pytest.approx(3.0 / 4.0)
    path = robot.calls_of("follow_path")[0]["path"]
    assert path.length == pytest.approx(5.0 - 1.0 - FRONT - PERSON, abs=0.01)
    assert THING not in {item.id for item in robot.standing_objects}
