"""Places that fit equally well after a push are ranked by the pose that was trusted before it."""

from math import exp, log, pi

import numpy as np
import pytest

from stack.localisation.mcl import trusted_pose
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.mcl.trusted_pose import TrustedPose
from stack.types import Pose2D, Scan
from tests.stack.localisation.drawn_office import Place, drawn, mapped, twin_rooms
from tests.stack.localisation.test_health import HERE, settled

BESIDE = 5.05
"""Metres between the twin rooms."""

PUSH = Pose2D(-0.5, 0.4, 0.6)


def pushed(
    place: Place, pose: Pose2D, *, disturbed: bool, push: Pose2D = PUSH
) -> tuple[Localiser, Scan, Pose2D]:
    """Return a localiser that trusted a pose before a push, the newest scan and the true pose."""
    generator = np.random.default_rng(7)
    localiser = settled(place, pose, generator)
    pose = pose.compose(push)
    scan = place.scan(pose, 1.0, generator)
    localiser.process(HERE, scan, disturbed=disturbed)
    return localiser, scan, pose


def corridor() -> Place:
    """A corridor of 8 m by 2 m with a cupboard at each end; half a turn maps it on itself."""
    ends = [(0.0, 0.0, 0.1, 2.0), (7.9, 0.0, 8.0, 2.0), (0.0, 0.0, 8.0, 0.1), (0.0, 1.9, 8.0, 2.0)]
    solid = drawn([*ends, (0.1, 0.1, 0.6, 0.5), (7.4, 1.5, 7.9, 1.9)], 8.0, 2.0)
    return Place(solid, mapped(solid))


@pytest.mark.parametrize("room", [0.0, BESIDE])
def test_a_pushed_robot_is_found_in_the_room_where_it_was(room):
    localiser, scan, truth = pushed(twin_rooms(), Pose2D(2.4 + room, 1.5, 0.3), disturbed=True)
    match = localiser.localise_globally(scan)
    assert match.pose.distance_to(truth) < 0.1
    # The other room remains a rival: a robot that was lifted may have been disturbed, too.
    (rival,) = localiser.estimate.rivals
    assert abs(rival.pose.x - truth.x) == pytest.approx(BESIDE, abs=0.1)
    # The push is 0.64 m and 0.6 rad: by the parameters, 0.91 and 1 standard deviations.
    near = 0.3 + 0.7 * exp(-0.5 * (0.41 / 0.7**2 + 1.0))
    assert rival.share == pytest.approx(0.3 / (0.3 + near), rel=0.05)


@pytest.mark.parametrize("heading", [0.2, 0.2 + pi])
def test_a_robot_pushed_in_a_symmetric_corridor_is_not_found_at_the_mirrored_place(heading):
    start, push = Pose2D(3.2, 1.0, heading), Pose2D(0.4, 0.0, 0.2)
    localiser, scan, truth = pushed(corridor(), start, disturbed=True, push=push)
    assert localiser.localise_globally(scan).pose.distance_to(truth) < 0.1
    mirrored = [rival.pose.distance_to(Pose2D(8.0 - truth.x, 2.0 - truth.y)) for rival in
                localiser.estimate.rivals]  # fmt: skip
    assert min(mirrored) < 0.1


@pytest.mark.parametrize("room", [0.0, BESIDE])
def test_a_lifted_robot_may_be_in_either_room(room):
    """Wheels and inertial sensor state nothing, and the scans fit elsewhere: no place is nearer."""
    lift = Pose2D(0.4, 2.0, 2.0)
    start = Pose2D(2.4 + room, 1.5, 0.3)
    localiser, scan, _ = pushed(twin_rooms(), start, disturbed=False, push=lift)
    localiser.localise_globally(scan)
    (rival,) = localiser.estimate.rivals
    assert rival.share == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("room", [0.0, BESIDE])
def test_a_push_that_odometry_does_not_notice_decides_between_equal_places_only(room):
    """The estimate is the place next to the trusted pose; the other is as probable."""
    localiser, scan, truth = pushed(twin_rooms(), Pose2D(2.4 + room, 1.5, 0.3), disturbed=False)
    assert localiser.localise_globally(scan).pose.distance_to(truth) < 0.1
    assert localiser.estimate.ambiguous


def test_evidence_outweighs_the_trusted_pose():
    """Lifted with a jolt to the other room, where a cupboard of the first one is missing."""
    place, generator = twin_rooms(), np.random.default_rng(8)
    place.solid[450:590, 530:590] = 1
    place.grid.cells[90:118, 106:118] = 100
    start, after = Pose2D(2.2, 1.2, 1.57), Pose2D(2.2 + BESIDE, 1.5, 1.4)
    localiser, scan, truth = pushed(place, start, disturbed=True, push=after.relative_to(start))
    localiser.localise_globally(scan)
    estimate = localiser.estimate
    places = [estimate.pose, *(rival.pose for rival in estimate.rivals)]
    assert min(pose.distance_to(truth) for pose in places) < 0.1
    odometry = HERE
    for step in range(12):
        truth, odometry = (pose.compose(Pose2D(0.3, 0.0, 0.01)) for pose in (truth, odometry))
        localiser.process(odometry, place.scan(truth, 1.1 + 0.1 * step, generator))
    estimate = localiser.estimate
    assert estimate.pose.distance_to(truth) < 0.1
    assert all(rival.share < 0.05 for rival in estimate.rivals)


@pytest.fixture
def pushes(monkeypatch):
    """Pushes of 0.5 m and 0.5 rad; a share of 0.04 is left to other places."""
    for name, value in {"PUSH_DISTANCE": 0.5, "PUSH_ANGLE": 0.5, "LIFTED_SHARE": 0.04}.items():
        monkeypatch.setattr(trusted_pose, name, value)


def test_places_are_weighed_by_their_distance_from_where_odometry_leads(pushes):
    """0.5 m off: 0.04 + 0.96 exp(-1/2); far away or turned round: 0.04."""
    trusted = TrustedPose()
    trusted.trust(Pose2D(2.0, 3.0, pi / 2), Pose2D(0.0, 0.0))
    trusted.drive(0.0, pushed=True)
    there = Pose2D(2.0, 4.0, pi / 2)  # a metre ahead of the trusted pose
    poses = [there, Pose2D(2.5, 4.0, pi / 2), Pose2D(9.0, 4.0, pi / 2), Pose2D(2.0, 4.0, -pi / 2)]
    found = trusted.log_priors(poses, Pose2D(1.0, 0.0))
    expected = [0.0, log(0.04 + 0.96 * exp(-0.5)), log(0.04), log(0.04)]
    assert found == pytest.approx(expected, abs=1e-4)


def test_slip_on_the_way_since_then_makes_the_trusted_pose_less_certain(pushes):
    """After 12 m, a tenth of it and 0.5 m: sqrt(1.2² + 0.5²) = 1.3 m is one deviation."""
    trusted = TrustedPose()
    trusted.trust(HERE, HERE)
    trusted.drive(12.0, pushed=True)
    (found,) = trusted.log_priors([Pose2D(12.0, 1.3)], Pose2D(12.0, 0.0))
    assert found == pytest.approx(log(0.04 + 0.96 * exp(-0.5)))


def test_without_a_push_or_a_trusted_pose_all_places_are_about_as_probable(pushes):
    trusted, poses = TrustedPose(), [HERE, Pose2D(9.0, 9.0), Pose2D(9.0, -8.0)]
    trusted.drive(1.0, pushed=True)
    assert trusted.log_priors(poses, HERE) == [0.0, 0.0, 0.0]
    trusted.trust(HERE, HERE)
    trusted.drive(1.0, pushed=False)
    near, *far = trusted.log_priors(poses, HERE)
    assert near == 0.0 and far[0] == far[1] == pytest.approx(log(0.99), abs=1e-6)
    trusted.drive(0.0, pushed=True)
    assert trusted.log_priors(poses, HERE)[1] == pytest.approx(log(0.04), abs=1e-4)
    trusted.forget()
    assert trusted.log_priors(poses, HERE) == [0.0, 0.0, 0.0]
