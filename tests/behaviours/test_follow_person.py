"""follow_person among people who walk as functions say."""

from math import hypot, pi

import numpy as np
import pytest
from py_trees.common import Status

from behaviours._motion.paths import shortened
from behaviours._people.followed_person import FollowedPerson
from behaviours.following.follow_person import FollowPerson
from behaviours.testing import halt, pause, tick
from stack.types import FailureCode, Path, Pose2D, Scan, TaskStatus
from tests.behaviours.walking_people import Escort, track

KEPT = 1.0 + 0.22 / np.cos(pi / 16) + 0.2
"""Metres between the centres at the default distance: front of the robot and radius of a person."""


def walks(start, velocity, until=1e9, begin=0.0):
    def at(time):
        seconds = min(max(time - begin, 0.0), until)
        return start[0] + velocity[0] * seconds, start[1] + velocity[1] * seconds

    return at


def gaps(robot, walk, after=0.0):
    return [
        hypot(walk(time)[0] - pose.x, walk(time)[1] - pose.y)
        for time, pose in robot.way
        if time >= after
    ]


def test_it_keeps_its_distance_to_a_walking_person():
    walk = walks((2.0, 0.0), (0.5, 0.0))
    robot, behaviour = Escort(walks=[walk]), FollowPerson(until_time=20.0)
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    steady = gaps(robot, walk, after=6.0)
    assert KEPT - 0.1 < min(steady) and max(steady) < KEPT + 0.7
    assert behaviour.travelled == pytest.approx(10.0 - (KEPT - 2.0) - 0.4, abs=0.6)
    assert behaviour.times_lost == 0
    assert behaviour.person.heading == pytest.approx(0.0)


def test_it_stops_and_ends_when_the_person_stands():
    walk = walks((2.0, 0.5), (0.5, 0.0), until=6.0)
    robot, behaviour = Escort(walks=[walk]), FollowPerson(until_stands=3.0)
    assert tick(behaviour, robot, 8.0) is Status.RUNNING
    assert robot.gives_way  # a robot that stands leaves the way of the person
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    # the walk of 6 s, 3 s of standing, and the mean velocity takes about 0.5 s to fade
    assert robot.time == pytest.approx(9.5, abs=0.6)
    assert gaps(robot, walk)[-1] == pytest.approx(KEPT, abs=0.35)
    assert min(gaps(robot, walk)) > 1.2
    at = Pose2D(*walk(10.0)).relative_to(robot.pose)
    assert abs(np.arctan2(at.y, at.x)) < 0.2


def test_standing_counts_only_after_a_walk():
    robot = Escort(walks=[walks((1.4, 0.0), (0.5, 0.0), begin=10.0, until=4.0)])
    behaviour = FollowPerson(until_stands=2.0)
    assert tick(behaviour, robot, 9.5) is Status.RUNNING
    assert tick(behaviour, robot, 20.0) is Status.SUCCESS


@pytest.mark.parametrize(
    ("ports", "followed"),
    [({}, 1), ({"near": Pose2D(-1.0, 0.0)}, 2), ({"near": Pose2D(4.0, 2.5)}, 3)],
)
def test_whom_it_follows(ports, followed):
    robot = Escort(walks=[
        walks((2.0, 0.0), (0.1, 0.0)), walks((-1.0, 0.0), (-0.1, 0.0)),
        walks((4.0, 2.0), (0.1, 0.0)),
    ])  # fmt: skip
    behaviour = FollowPerson(**ports)
    assert tick(behaviour, robot, 1.0) is Status.RUNNING
    assert (behaviour.person.x, behaviour.person.y) == pytest.approx(
        robot.walks[followed - 1](1.0), abs=0.03
    )


def test_nobody_ahead_is_a_failure_after_the_patience():
    robot = Escort(walks=[walks((-2.0, 0.0), (-0.1, 0.0))])
    behaviour = FollowPerson(patience=4.0)
    assert tick(behaviour, robot, 10.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.PERSON_LOST
    assert behaviour.failure.sentence == "no walking person ahead within 4 s"
    assert robot.time == pytest.approx(4.0)


def test_somebody_who_crosses_is_not_followed():
    guide = walks((2.0, 0.0), (0.5, 0.0))
    crosser = walks((4.2, 3.0), (0.0, -0.9), begin=1.0)  # between robot and guide at about 4.3 s
    robot = Escort(walks=[guide, crosser])

    def hides(pose, at):
        """The crosser hides the guide while they are nearly in line."""
        x, y = crosser(robot.time)
        ahead = at != crosser(robot.time) and pose.x < x < at[0]
        return ahead and abs(y - pose.y) < 0.3

    robot.hides = hides
    behaviour = FollowPerson(until_time=15.0)
    assert tick(behaviour, robot, 20.0) is Status.SUCCESS
    assert behaviour.person.y == pytest.approx(0.0, abs=0.05)
    assert behaviour.person.x == pytest.approx(guide(15.0)[0], abs=0.2)


def corner_hides(pose, at):
    """A wall along y = 0.6 from x = 0 to x = 4: what is beyond is seen only from near its end."""
    return at[1] > 0.6 and pose.x < 3.6


def test_it_finds_somebody_who_went_round_a_corner():
    def guide(time):
        along = 2.0 + 1.0 * time
        return (along, 0.0) if along < 5.0 else (5.0, along - 5.0 if along < 9.0 else 4.0)

    robot = Escort(walks=[guide], hides=corner_hides, corner=(4.8, 0.0))
    behaviour = FollowPerson(until_stands=1.0)
    assert tick(behaviour, robot, 40.0) is Status.SUCCESS
    assert behaviour.times_lost >= 1
    assert (behaviour.person.x, behaviour.person.y) == pytest.approx((5.0, 4.0), abs=0.1)
    assert min(gaps(robot, guide)) > 1.1


def test_it_searches_where_the_person_was_seen_and_then_gives_up():
    gone = walks((2.0, 0.0), (0.5, 0.0))
    robot = Escort(walks=[gone])
    robot.hides = lambda pose, at: robot.time > 5.0
    behaviour = FollowPerson(patience=15.0)
    assert tick(behaviour, robot, 40.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.PERSON_LOST
    assert "out of sight for 15 s" in behaviour.failure.sentence
    first, beyond = (call["goal"] for call in robot.calls_of("navigate_to"))
    last = gone(5.0)[0]
    assert first.x == pytest.approx(last, abs=0.3)
    assert beyond.x == pytest.approx(last + 2.0 * 0.5, abs=0.4)  # where 2 s more take them
    assert robot.calls_of("spin")[0]["angle"] == pytest.approx(2.0 * pi)
    assert robot.time == pytest.approx(5.0 + 0.5 + 15.0, abs=0.5)


def test_it_moves_round_what_may_hide_a_person_who_walks_on():
    robot = Escort(walks=[walks((1.3, 0.3), (0.0, 0.3))])
    angles = np.linspace(-pi, pi, 360, endpoint=False)
    ranges = np.full(360, np.inf, np.float32)
    ranges[185:195] = 0.7  # a jamb in the lane to the person, who is nearer than the distance
    robot.scan = Scan(0.0, ranges, float(angles[0]), 2.0 * pi / 360, 0.1, 12.0)
    behaviour = FollowPerson(distance=1.5)
    assert tick(behaviour, robot, 0.4) is Status.RUNNING
    assert robot.calls_of("plan")
    robot.scan.ranges[:] = np.inf
    free = Escort(walks=robot.walks, scan=robot.scan)
    other = FollowPerson(distance=1.5)
    assert tick(other, free, 0.4) is Status.RUNNING
    assert not free.calls_of("plan")


def test_plans_that_fail_end_it_after_a_while():
    robot = Escort(walks=[walks((3.0, 0.0), (0.1, 0.0))])

    def plan(goal, start=None):
        task = super(Escort, robot).plan(goal, start)
        task.fail(FailureCode.NO_VALID_PATH, "walled in")
        return task

    robot.plan = plan
    behaviour = FollowPerson()
    assert tick(behaviour, robot, 20.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.NO_VALID_PATH
    assert 8.0 <= robot.time < 10.0


def test_a_lost_robot_is_a_failure_at_once():
    robot = Escort(walks=[walks((3.0, 0.0), (0.1, 0.0))])
    behaviour = FollowPerson()
    tick(behaviour, robot, 0.5)
    robot.motion.fail(FailureCode.LOST, "the scans do not fit")
    assert tick(behaviour, robot, 0.2) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.LOST


def test_the_other_ends():
    walk = walks((2.0, 0.0), (0.5, 0.0))
    robot, behaviour = Escort(walks=[walk]), FollowPerson(until_travelled=2.0)
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    assert behaviour.travelled == pytest.approx(2.0, abs=0.1)
    robot = Escort(walks=[walk])
    behaviour = FollowPerson(until_place=Pose2D(5.0, 0.0), place_radius=0.5)
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    assert robot.pose.x == pytest.approx(4.5, abs=0.1)


def test_a_pause_does_not_count():
    robot = Escort(walks=[walks((2.0, 0.0), (0.5, 0.0))])
    behaviour = FollowPerson(until_time=5.0)
    tick(behaviour, robot, 2.0)
    pause(behaviour, robot, 10.0)
    assert tick(behaviour, robot, 2.0) is Status.RUNNING
    assert tick(behaviour, robot, 2.0) is Status.SUCCESS


def test_it_stops_when_halted():
    robot = Escort(walks=[walks((3.0, 0.0), (0.5, 0.0))])
    behaviour = FollowPerson()
    tick(behaviour, robot, 1.0)
    halt(behaviour)
    assert robot.motion.status is TaskStatus.CANCELLED
    assert robot.twist.linear == 0.0


def test_its_speed_limit_is_that_of_the_path():
    robot = Escort(walks=[walks((4.0, 0.0), (0.1, 0.0))])
    tick(FollowPerson(speed=0.3), robot, 0.5)
    path = robot.calls_of("follow_path")[0]["path"]
    assert path.speed_limits.max() == 0.3
    assert path.length == pytest.approx(4.0 - KEPT, abs=0.2)


# Which track is the person's


def follow(person, *steps):
    for time, *tracks in steps:
        person.update(tracks, time)
    return person


def test_exchanged_tracks_are_told_by_the_motion():
    # Two people meet after 2 s and walk on; their tracks turn round, which people do not do.
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    for n in range(1, 46):
        t = 0.1 * n
        guide, other = ((0.8 * t, 0.0), (0.8, 0.0)), ((3.2 - 0.8 * t, 0.2), (-0.8, 0.0))
        if n > 20:
            guide, other = other, guide
        person.update([track(1, *guide), track(2, *other)], t)
        if n == 20:
            assert person.seen.id == 1
    assert person.seen.id == 2 and person.times_lost == 0
    assert person.seen.position[0] == pytest.approx(0.8 * 4.5)


def test_a_person_who_turns_round_beside_somebody_is_not_exchanged():
    # The other one walks north all the time: nobody walks now as the person did before.
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    for n in range(1, 46):
        t = 0.1 * n
        v, x = (0.8, 0.8 * t) if t < 2.0 else (-0.8, 3.2 - 0.8 * t)
        beside = track(2, (1.8, -1.2 + 0.6 * t), (0.0, 0.6))
        person.update([track(1, (x, 0.0), (v, 0.0)), beside], t)
    assert person.seen.id == 1


def test_people_who_turn_round_together_are_not_exchanged():
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    for n in range(1, 30):
        t = 0.1 * n
        v, x = (0.8, 0.8 * t) if t < 1.0 else (-0.8, 1.6 - 0.8 * t)
        person.update([track(1, (x, 0.0), (v, 0.0)), track(2, (2.0, 0.3), (0.0, 0.0))], t)
    assert person.seen.id == 1


def test_a_new_track_where_the_person_is_expected_is_theirs():
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    follow(person, (0.5,), (1.5, track(4, (1.2, 0.1), (0.8, 0.0))))
    assert (person.seen.id, person.visible, person.times_lost) == (4, True, 1)


def test_a_new_track_far_away_or_of_somebody_else_is_not():
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    other = track(2, (1.5, 1.5), (0.0, -0.8))
    follow(person, (0.1, track(1, (0.08, 0.0), (0.8, 0.0)), other), (0.5, other))
    assert not person.visible  # number 2 was seen beside the person
    follow(person, (1.0,), (1.4, track(5, (1.4, 0.4), (0.0, -0.8))))
    assert not person.visible  # where number 2 is expected, and not where the person is
    follow(person, (1.5, track(6, (9.0, 0.0), (0.8, 0.0))))
    assert not person.visible


def test_somebody_who_turned_out_of_sight_is_found_after_a_while():
    # Round a corner at 0.8 m/s: 2.0 m from where the person is expected, and across their way.
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    person.update([], 1.0)
    for n in range(10, 60):
        if person.visible:
            break
        person.update([track(2, (1.2, 2.0), (0.0, 0.3))], 0.1 * n)
    assert person.seen.id == 2
    # reach 0.8 + 0.8 t = 2.0 + 0.8 exp(-t / 5) |(0, 0.3) - (0.8, 0)|
    assert person.seen.stamp == pytest.approx(2.2, abs=0.15)


def test_an_uncertain_track_is_out_of_sight():
    person = FollowedPerson(track(1, (0.0, 0.0), (0.8, 0.0)), 0.0)
    follow(person, (0.6, track(1, (0.48, 0.0), (0.8, 0.0), deviation=0.4)))
    assert not person.visible and person.times_lost == 0
    assert person.expected(1.0) == pytest.approx((0.8, 0.0))
    assert person.expected(9.0) == pytest.approx((1.2, 0.0))  # expected to walk on for 1.5 s


def test_a_shortened_path_ends_before_its_end():
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 1.0]])
    path = shortened(Path(points, np.array([0.5, np.inf, np.inf])), 1.5, 0.8)
    assert path.length == pytest.approx(2.5)
    assert (path.goal.x, path.goal.y) == pytest.approx((2.0, 0.5))
    assert path.goal.heading == pytest.approx(0.5 * pi)  # towards the former end
    assert path.speed_limits.tolist() == [0.5, 0.8, 0.8]
    assert shortened(Path(points), 4.0) is None
