"""Global scan matching: finds the pose by lidar only, and reports ambiguous places."""

from math import log

import numpy as np
import pytest

from stack.errors import NavigationError
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.search.matches import GlobalMatch, distinct
from stack.localisation.search.rivals import RIVAL_DEAD_ZONE, RIVAL_SHARE, resolve
from stack.types import FailureCode, Pose2D, wrap_angle
from tests.stack.localisation.drawn_office import office, twin_rooms
from tests.stack.navigation.toy_world import robot


def crowd(pose: Pose2D, count: int, generator: np.random.Generator):
    around = generator.uniform([0.5, -np.pi], [3.0, np.pi], (count, 2))
    return [(pose.x + d * np.cos(a), pose.y + d * np.sin(a), 0.2) for d, a in around]


def test_the_pose_is_found_among_people_and_is_never_wrong():
    place, generator = office(), np.random.default_rng(1)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 0)
    found = 0
    for _ in range(25):
        place.people = []
        pose = place.free_pose(generator)
        place.people = crowd(pose, 3, generator)
        try:
            match = localiser.localise_globally(place.scan(pose, 0.0, generator))
        except NavigationError:
            continue
        if localiser.estimate.ambiguous:
            continue
        assert match.pose.distance_to(pose) < 0.15
        assert abs(wrap_angle(match.pose.heading - pose.heading)) < 0.05
        assert localiser.estimate.pose.distance_to(match.pose) < 1e-6
        found += 1
    assert found >= 20


def test_twin_rooms_are_rivals():
    place, generator = twin_rooms(), np.random.default_rng(2)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 0)
    for _ in range(10):
        pose = place.free_pose(generator)
        localiser.localise_globally(place.scan(pose, 0.0, generator))
        estimate = localiser.estimate
        assert estimate.ambiguous
        beside = 5.05 if pose.x < 5.1 else -5.05
        places = [estimate.pose, *(rival.pose for rival in estimate.rivals)]
        for x in (pose.x, pose.x + beside):
            assert min(at.distance_to(Pose2D(x, pose.y)) for at in places) < 0.1
        assert sum(rival.share for rival in estimate.rivals) < 1.0


def test_a_second_view_resolves_an_ambiguity():
    """One room has a corner that its twin has not; views from both ends resolve the pose."""
    place, generator = twin_rooms(), np.random.default_rng(4)
    place.solid[250:350, 900:1000] = 1
    grid = place.grid
    grid.cells[50:70, 180:200] = 100
    localiser = Localiser(LocaliserParameters(), robot(), grid, 0)
    hidden, open_view = Pose2D(1.0, 1.5, 0.0), Pose2D(3.0, 3.9, 0.0)
    scan = place.scan(open_view, 1.0, generator)
    earlier = [(hidden.relative_to(open_view), place.scan(hidden, 0.0, generator))]
    best = localiser.map.search.everywhere(scan, earlier)[0]
    assert best.pose.distance_to(open_view) < 0.1


def test_a_scan_from_another_building_is_lost():
    place, generator = office(), np.random.default_rng(5)
    localiser = Localiser(LocaliserParameters(), robot(), twin_rooms().grid, 0)
    pose = Pose2D(6.5, 4.6, 0.3)
    with pytest.raises(NavigationError) as caught:
        localiser.localise_globally(place.scan(pose, 0.0, generator))
    assert caught.value.failure.code == FailureCode.LOST


def test_rivals_have_a_share_of_the_probability():
    assert (RIVAL_SHARE, RIVAL_DEAD_ZONE) == (0.01, 0.75)
    near = GlobalMatch(Pose2D(1.0, 2.0), 0.9, cost=2.0)
    rival = GlobalMatch(Pose2D(7.0, 2.0), 0.8, cost=2.75 - log(0.011))
    no_rival = GlobalMatch(Pose2D(7.0, 9.0), 0.8, cost=2.75 - log(0.009))
    matches, weights = zip(*resolve([near, rival, no_rival], 0.6), strict=True)
    assert matches == (near, rival)
    assert weights == pytest.approx([0.0, log(0.011)])
    assert resolve([near], 0.6) == [(near, 0.0)]
    with pytest.raises(NavigationError, match="LOST: the best place on the map explains 90%"):
        resolve([near], 0.95)
    with pytest.raises(NavigationError, match="LOST: the best place on the map explains 0%"):
        resolve([], 0.6)


def test_how_well_beams_end_at_walls_ranks_rivals_but_drops_none():
    first = GlobalMatch(Pose2D(1.0, 2.0), 0.9, evidence=-2.0)
    second = GlobalMatch(Pose2D(7.0, 2.0), 0.9, evidence=-12.0)
    assert [match for match, _ in resolve([second, first], 0.6)] == [first, second]


def test_distinct_means_distant_or_rotated():
    poses = Pose2D(0.0, 0.0, 3.1), Pose2D(0.3, 0.3, -3.1), Pose2D(0.5, 0.0, 3.1), Pose2D(0, 0, 2.5)
    kept = distinct([GlobalMatch(pose, 1.0) for pose in poses])
    assert [match.pose for match in kept] == [poses[0], *poses[2:]]
