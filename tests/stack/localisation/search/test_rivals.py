"""Rival poses: they follow odometry, and go when a scan tells them from the estimate."""

import numpy as np
import pytest

from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.types import Pose2D, has_jumped
from tests.stack.localisation.drawn_office import twin_rooms
from tests.stack.navigation.toy_world import robot

BESIDE = 5.05
"""Metres between the twin rooms."""


def rooms_that_differ():
    """Twin rooms with a cupboard in the upper left corner of the right one only."""
    place = twin_rooms()
    place.solid[450:590, 530:590] = 1
    place.grid.cells[90:118, 106:118] = 100
    return place


def started(place, pose, odometry, generator):
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 0)
    localiser.process(odometry, None)
    localiser.process(odometry, place.scan(pose, 0.0, generator))
    return localiser


def drive(localiser, place, truth, odometry, steps, generator):
    """Drive by equal steps in the base frame with a scan after each; return truth, odometry."""
    for step in steps:
        truth, odometry = truth.compose(step), odometry.compose(step)
        localiser.process(odometry, place.scan(truth, 0.0, generator))
    return truth, odometry


@pytest.mark.parametrize("right_room", [False, True])
def test_an_unknown_start_names_its_rival_and_driving_resolves_it(right_room):
    place, generator = rooms_that_differ(), np.random.default_rng(3)
    shift = BESIDE if right_room else 0.0
    truth = Pose2D(2.2, 1.2, 1.57)
    truth, odometry = Pose2D(truth.x + shift, truth.y, truth.heading), Pose2D(-3.0, 8.0, 0.4)
    localiser = started(place, truth, odometry, generator)
    assert localiser.estimate.ambiguous
    steps = [Pose2D(0.3, 0.0, 0.0)] * 12
    truth, odometry = drive(localiser, place, truth, odometry, steps, generator)
    estimate = localiser.estimate
    assert estimate.rivals == ()
    assert estimate.pose.distance_to(truth) < 0.1


def test_rivals_follow_the_odometry():
    place, generator = twin_rooms(), np.random.default_rng(4)
    truth, odometry = Pose2D(2.2, 1.2, 1.57), Pose2D(1.0, 2.0, -0.7)
    localiser = started(place, truth, odometry, generator)
    flips, before = 0, localiser.estimate
    for _ in range(15):
        step = [Pose2D(0.1, 0.0, 0.02)]
        truth, odometry = drive(localiser, place, truth, odometry, step, generator)
        flips, before = flips + has_jumped(before, localiser.estimate), localiser.estimate
    estimate = localiser.estimate
    assert len(estimate.rivals) == 1
    poses = sorted([estimate.pose, estimate.rivals[0].pose], key=lambda pose: pose.x)
    assert poses[0].distance_to(truth) < 0.1
    assert poses[1].distance_to(Pose2D(truth.x + BESIDE, truth.y)) < 0.1
    assert 0.0 < estimate.rivals[0].share < 1.0
    # The rooms differ only by rounding of the map; the estimate must not flip between them.
    assert flips <= 2


def test_a_known_pose_ends_the_ambiguity():
    place, generator = twin_rooms(), np.random.default_rng(4)
    localiser = started(place, Pose2D(2.2, 1.2, 1.57), Pose2D(0.0, 0.0), generator)
    assert localiser.estimate.ambiguous
    localiser.set_pose(Pose2D(2.2, 1.2, 1.57), 0.1, 0.05)
    assert localiser.estimate.rivals == ()


def test_a_trusted_pose_in_the_wrong_room_is_found_out():
    """Beams pass through a mapped cupboard and a mapped counter, though most of them fit."""
    place, generator = rooms_that_differ(), np.random.default_rng(5)
    place.solid[100:300, 920:1000] = 1
    place.grid.cells[20:60, 184:200] = 100
    truth, odometry = Pose2D(2.2, 1.2, 1.57), Pose2D(0.0, 0.0)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 0)
    localiser.process(odometry)
    localiser.set_pose(Pose2D(truth.x + BESIDE, truth.y, truth.heading), 0.1, 0.05)
    fits = []
    for step in range(24):
        move = Pose2D(0.1, 0.0, 0.0)
        truth, odometry = truth.compose(move), odometry.compose(move)
        localiser.process(odometry, place.scan(truth, 0.2 * step, generator))
        fits.append(localiser.estimate.pose.distance_to(truth) < 0.1)
    assert not fits[0]
    assert fits[-1]


def test_places_that_a_search_has_just_found_do_not_lower_the_health():
    place, generator = twin_rooms(), np.random.default_rng(6)
    localiser = started(place, Pose2D(2.2, 1.2, 1.57), Pose2D(0.0, 0.0), generator)
    hypotheses = localiser._filter.hypotheses
    assert hypotheses.share_among_rivals == pytest.approx(0.5, abs=0.1)
    hypotheses.others[0].weighed = 0.0
    assert hypotheses.share_among_rivals == 1.0
    assert localiser.estimate.covariance[0, 0] < 0.05**2
