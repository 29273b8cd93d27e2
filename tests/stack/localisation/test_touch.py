"""Who walks into the robot is seen by the lidar: the pose is then near the one before."""

from math import exp, log, pi

import numpy as np
import pytest

from stack.localisation.distance_field import surface_field
from stack.localisation.health import ScanEvaluator
from stack.localisation.mcl import touch, trusted_pose
from stack.localisation.mcl.touch import TouchSense
from stack.localisation.mcl.trusted_pose import TrustedPose
from stack.types import Pose2D
from tests.stack.localisation.test_health import HERE, beside, office, robot, settled
from tests.stack.localisation.test_trusted_pose import corridor


@pytest.fixture
def pushes(monkeypatch):
    """Pushes of 0.5 m and 0.5 rad; a share of 0.01 is left to other places."""
    for name, value in {"PUSH_DISTANCE": 0.5, "PUSH_ANGLE": 0.5, "CARRIED_SHARE": 0.01}.items():
        monkeypatch.setattr(trusted_pose, name, value)


def touch_of(place) -> TouchSense:
    evaluator = ScanEvaluator(surface_field(place.grid), 0.01)
    return TouchSense(robot().footprint, evaluator)


@pytest.mark.parametrize("bearing", [0.0, pi / 2, pi, -pi / 2])
@pytest.mark.parametrize(("gap", "expected"), [(0.01, True), (0.15, False)])
def test_a_person_at_the_body_touches_it(bearing, gap, expected):
    """A person of 0.2 m radius; the body reaches as far in this direction as its corners say."""
    place, pose = office(), Pose2D(2.0, 2.5, 0.4)
    corners = robot().footprint.points
    reach = float((corners @ [np.cos(bearing), np.sin(bearing)]).max())
    place.people.append(beside(pose, reach + gap + 0.2, bearing))
    scan = place.scan(pose, 1.0, np.random.default_rng(3))
    assert touch_of(place).touches(scan, pose) is expected


def test_a_wall_of_the_map_touches_nobody():
    """The side of the body is 2 cm from the wall at y = 0.1 m."""
    place = office()
    half_width = float(robot().footprint.points[:, 1].max())
    pose = Pose2D(2.0, 0.1 + half_width + 0.02, 0.0)
    scan = place.scan(pose, 1.0, np.random.default_rng(3))
    assert not touch_of(place).touches(scan, pose)


def pushed_by_a_person(place, start: Pose2D, push: Pose2D):
    """A localiser that a person in front has pushed in steps of a scan, and the true pose."""
    generator = np.random.default_rng(7)
    reach = robot().footprint.front
    localiser, truth = settled(place, start, generator), start
    for step in range(20):
        share = min(1.0, step / 10)
        truth = start.compose(Pose2D(share * push.x, share * push.y, share * push.heading))
        place.people[:] = [beside(truth, reach + 0.2, 0.0)]
        localiser.process(HERE, place.scan(truth, 1.1 + 0.1 * step, generator))
    place.people.clear()
    localiser.process(HERE, place.scan(truth, 3.2, generator))
    return localiser, place.scan(truth, 3.3, generator), truth


@pytest.mark.parametrize("heading", [0.2, 0.2 + pi])
def test_after_a_touch_the_mirrored_place_of_a_corridor_is_no_rival(heading):
    """Without a touch it is one: test_trusted_pose.py."""
    start = Pose2D(3.2, 1.0, heading)
    localiser, scan, truth = pushed_by_a_person(corridor(), start, Pose2D(-0.4, 0.0, 0.0))
    assert localiser.localise_globally(scan).pose.distance_to(truth) < 0.1
    assert not localiser.estimate.ambiguous


def test_the_search_of_the_filter_finds_no_mirrored_place_either():
    """While it stands after a push of 0.4 m."""
    start = Pose2D(3.2, 1.0, 0.2)
    localiser, _, truth = pushed_by_a_person(corridor(), start, Pose2D(-0.4, 0.0, 0.0))
    generator, place = np.random.default_rng(9), corridor()
    for step in range(40):
        localiser.process(HERE, place.scan(truth, 3.4 + 0.1 * step, generator))
        far = [r for r in localiser.estimate.rivals if r.pose.distance_to(truth) > 1.0]
        assert localiser.estimate.pose.distance_to(truth) < 1.0 and not far


@pytest.mark.parametrize(("x", "heading"), [(2.2, 0.1), (5.8, 0.1 + pi)])
def test_a_robot_that_was_pushed_far_along_a_symmetric_corridor_has_not_turned_round(x, heading):
    """3.2 m: farther than one push, so that both places are as far away; the heading decides."""
    start, place = Pose2D(x, 1.0, heading), corridor()
    localiser, _, _ = pushed_by_a_person(place, start, Pose2D(0.0, 0.0, 0.0))
    truth = start.compose(Pose2D(3.2, -0.3, 0.0))
    scan = place.scan(truth, 3.3, np.random.default_rng(5))
    assert localiser.localise_globally(scan).pose.distance_to(truth) < 0.1
    turns = [r.pose.relative_to(truth).heading for r in localiser.estimate.rivals]
    assert all(abs(turn) < 1.0 for turn in turns)  # others along the corridor may remain


def test_a_place_far_away_is_less_probable_still_with_another_heading(pushes):
    """Far away 0.01, as before; turned round besides 0.01 times 0.005."""
    trusted, poses = TrustedPose(), [Pose2D(9.0, 0.0), Pose2D(9.0, 0.0, pi)]
    trusted.trust(HERE, HERE)
    trusted.drive(0.0, pushed=False, touched=True)
    found = trusted.log_priors(poses, HERE)
    assert found == pytest.approx([log(0.01), log(0.01 * 0.005)], abs=0.01)


def test_a_touch_counts_for_two_metres_although_the_pose_is_trusted(pushes):
    """0.5 m off, one deviation: 0.01 + 0.99 exp(-1/2). Far away 0.01: no rival any more."""
    trusted, poses = TrustedPose(), [Pose2D(0.5, 0.0), Pose2D(9.0, 0.0)]
    trusted.trust(HERE, HERE)
    trusted.drive(0.0, pushed=False, touched=True)
    trusted.trust(HERE, HERE)
    found = trusted.log_priors(poses, HERE)
    assert found == pytest.approx([log(0.01 + 0.99 * exp(-0.5)), log(0.01)], abs=1e-4)
    trusted.drive(1.9, pushed=False)
    assert trusted.is_touched
    trusted.drive(0.2, pushed=False)
    assert not trusted.is_touched


def test_the_trusted_pose_is_pushed_on_and_on_but_does_not_leap(pushes):
    """Four steps of 0.5 m, then 5 m at once: deviations are 0.5 m."""
    trusted = TrustedPose()
    trusted.trust(HERE, HERE)
    trusted.drive(0.0, pushed=False, touched=True)
    for step in range(1, 5):
        trusted.follow(Pose2D(0.5 * step, 0.0), HERE)
    assert trusted.log_priors([Pose2D(2.0, 0.0)], HERE) == [0.0]
    trusted.follow(Pose2D(7.0, 0.0), HERE)
    assert trusted.log_priors([Pose2D(2.0, 0.0)], HERE) == [0.0]


def test_nobody_who_touches_it_leaves_the_trusted_pose_where_it_was(pushes):
    trusted = TrustedPose()
    trusted.trust(HERE, HERE)
    trusted.follow(Pose2D(0.3, 0.0), HERE)
    trusted.drive(0.0, pushed=False, touched=True)
    assert trusted.log_priors([HERE], HERE) == [0.0]


def pushed_slowly() -> float:
    """Largest error while a person pushes the robot back by 1 m at 0.1 m/s and the wheels stand."""
    place, generator, start = office(), np.random.default_rng(7), Pose2D(2.5, 2.7, 0.4)
    reach, worst = robot().footprint.front, 0.0
    localiser = settled(place, start, generator)
    for step in range(100):
        truth = start.compose(Pose2D(-0.01 * step, 0.0, 0.0))
        place.people[:] = [beside(truth, reach + 0.2, 0.0)]
        localiser.process(HERE, place.scan(truth, 1.1 + 0.1 * step, generator))
        worst = max(worst, localiser.estimate.pose.distance_to(truth))
    return worst


def test_the_pose_follows_a_slow_push_while_the_wheels_stand(monkeypatch):
    """Two deviations of the pose at standstill, and the way of 0.3 s."""
    assert pushed_slowly() < 0.05
    monkeypatch.setattr(touch, "TOUCH_SPEED", 0.0)
    assert pushed_slowly() > 0.1
