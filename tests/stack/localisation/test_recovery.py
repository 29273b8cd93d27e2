"""Pushes and kidnaps heal inside the filter, also at standstill, and at no other time."""

from math import pi

import numpy as np
import pytest

from stack.localisation.health import ScanView
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.mcl.recovery import (
    RECOVERY_ANGLE,
    RECOVERY_PERIOD,
    RECOVERY_TIME,
    RecoverySchedule,
)
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.particle_filter.odometry_since import MotionSince
from stack.types import Pose2D
from tests.stack.localisation.drawn_office import office, twin_rooms
from tests.stack.localisation.test_health import HERE, is_kidnap, settled
from tests.stack.navigation.toy_world import robot

GOOD, BAD = ScanView(0.9, 0.05, 0.0, 1.0), ScanView(0.2, 0.3, 0.4, 30.0)


def healed(place, localiser, generator, pose: Pose2D, moved: Pose2D, seconds: float) -> float:
    """Seconds until the error stays below 0.1 m; inf if it does not."""
    since, odometry = np.inf, HERE
    for step in range(round(10 * seconds)):
        pose, odometry = pose.compose(moved), odometry.compose(moved)
        localiser.process(odometry, place.scan(pose, 1.0 + 0.1 * step, generator))
        near = localiser.estimate.pose.distance_to(pose) < 0.1
        since = min(since, 0.1 * (step + 1)) if near else np.inf
    return since


@pytest.mark.parametrize("moved", [HERE, Pose2D(0.0, 0.0, 0.05)])
def test_pushes_heal(moved):
    """Shoves of 0.1 m to 2 m by up to 60 degrees: at least 9 of 10 within 4 s."""
    place, generator, good = office(), np.random.default_rng(21), 0
    localiser = None
    for _ in range(10):
        pose = place.free_pose(generator)
        localiser = settled(place, pose, generator, localiser)
        after = pose
        while after is pose or not place.is_clear(after.x, after.y):
            distance, bearing = generator.uniform(0.1, 2.0), generator.uniform(-pi, pi)
            turn = generator.uniform(-pi / 3, pi / 3)
            shove = Pose2D(distance * np.cos(bearing), distance * np.sin(bearing), turn)
            after = pose.compose(shove)
        good += healed(place, localiser, generator, after, moved, 4.0) < 4.0
    assert good >= 9


def test_small_shoves_heal_within_two_searches():
    """After 0.17 m the scans end beside the walls: no beam is long, and none meets a new thing."""
    place, generator = office(), np.random.default_rng(23)
    localiser, seconds = None, []
    for bearing in np.arange(8) * pi / 4:
        pose = place.free_pose(generator)
        after = pose.compose(Pose2D(0.17 * np.cos(bearing), 0.17 * np.sin(bearing)))
        localiser = settled(place, pose, generator, localiser)
        seconds.append(healed(place, localiser, generator, after, HERE, 3.0))
    assert sorted(seconds)[-2] <= RECOVERY_TIME + 2 * RECOVERY_PERIOD + 0.2


def test_kidnaps_heal_without_the_mission():
    place, generator, good = office(), np.random.default_rng(22), 0
    localiser = None
    for _ in range(5):
        pose, after = place.free_pose(generator), place.free_pose(generator)
        while not is_kidnap(place, pose, after, twins=False):
            after = place.free_pose(generator)
        localiser = settled(place, pose, generator, localiser)
        turning = Pose2D(0.0, 0.0, 0.05)
        good += healed(place, localiser, generator, after, turning, 5.0) < 5.0
    assert good >= 5


def test_a_kidnap_among_twin_rooms_leaves_a_rival():
    place, generator = twin_rooms(), np.random.default_rng(5)
    localiser = settled(place, Pose2D(2.4, 1.5, 0.3), generator)
    other = Pose2D(2.8 + 5.05, 4.5, 2.0)
    healed(place, localiser, generator, other, Pose2D(0.0, 0.0, 0.05), 6.0)
    estimate = localiser.estimate
    poses = [estimate.pose, *(rival.pose for rival in estimate.rivals)]
    assert len(poses) == 2
    for x in (2.8, 2.8 + 5.05):
        assert min(pose.distance_to(Pose2D(x, 4.5)) for pose in poses) < 0.15
    assert not estimate.is_lost


def test_a_stated_push_spreads_the_particles():
    place, generator = office(), np.random.default_rng(3)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 3)
    pose = Pose2D(5.75, 4.5, 0.0)
    localiser.process(HERE, None)
    localiser.set_pose(pose, 0.02, 0.02)
    localiser.process(HERE, place.scan(pose, 0.0, generator))
    before = float(np.std(localiser.particles[:, 0]))
    localiser._filter.predict(MotionSince(HERE, np.diag([0.3**2, 0.0, 0.0]), disturbed=True))
    assert np.std(localiser.particles[:, 0]) == pytest.approx(np.hypot(before, 0.3), rel=0.1)


def test_the_windows_widen_to_the_whole_map():
    plan, found = RecoverySchedule(), []
    for step in range(60):
        search = plan.next(0.1 * step, BAD, 0.5)
        if search is not None:
            found.append((round(0.1 * step, 1), search.distance))
    # after 0.3 s of bad scans, then every 0.5 s; the whole map, and again 3 s later
    assert found == [(0.3, 1.0), (0.8, 1.0), (1.3, 2.0), (1.8, 2.5), (2.3, np.inf), (5.4, np.inf)]


def test_well_fitting_scans_cause_no_search():
    plan = RecoverySchedule()
    assert all(plan.next(0.1 * step, GOOD, 0.5) is None for step in range(600))


def test_a_stated_push_searches_at_the_first_bad_scan_in_a_wider_window():
    plan = RecoverySchedule()
    plan.next(0.0, GOOD, 0.5)
    plan.disturb(0.1)
    search = plan.next(0.1, BAD, 0.5)
    assert search is not None
    assert search.angle == pytest.approx(2.0 * RECOVERY_ANGLE)


def test_a_found_place_is_verified_on_the_whole_map():
    plan = RecoverySchedule()
    plan.verify(0.0)
    found = [step for step in range(20) if plan.next(0.1 * step, GOOD, 0.5) is not None]
    assert found == [5], "after 0.5 s, once"
