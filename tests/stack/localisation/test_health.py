"""Health: high while people pass, low after a kidnap, and calibrated on each map."""

from math import cos, pi, sin

import numpy as np
import pytest

from stack.localisation.distance_field import surface_field
from stack.localisation.health import FitScale, RecentViews, ScanEvaluator, ScanView, calibrate
from stack.localisation.health_model import HealthFeatures, health
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.types import Pose2D, Scan, wrap_angle
from tests.stack.localisation.drawn_office import DOORS, Place, office, twin_rooms
from tests.stack.navigation.toy_world import robot

HERE = Pose2D(0.0, 0.0)
STEP = Pose2D(0.0, 0.0, 0.05)


def settled(place: Place, pose: Pose2D, generator, localiser: Localiser | None = None) -> Localiser:
    """A filter after one second at its true pose."""
    localiser = localiser or Localiser(LocaliserParameters(), robot(), place.grid, 0)
    localiser.process(HERE, None)
    localiser.set_pose(pose, 0.03, 0.03)
    stand(localiser, place, pose, 0.0, generator)
    return localiser


def stand(localiser, place, pose, begin, generator) -> list[float]:
    """Health values over the second from `begin` on."""
    qualities = []
    for step in range(10):
        localiser.process(HERE, place.scan(pose, begin + 0.1 * step, generator))
        qualities.append(localiser.estimate.health)
    return qualities


def beside(pose: Pose2D, distance: float, bearing: float) -> tuple[float, float, float]:
    angle = pose.heading + bearing
    return (pose.x + distance * cos(angle), pose.y + distance * sin(angle), 0.2)


def test_no_false_alarms_among_people():
    """Poses anywhere, up to four people within 3 m, for 2 s each: at most 1 % of scans."""
    place, generator = office(), np.random.default_rng(1)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 0)
    low = []
    for episode in range(40):
        place.people = []
        pose = place.free_pose(generator)
        localiser.process(HERE, None)
        localiser.set_pose(pose, 0.03, 0.03)
        crowd = [(generator.uniform(0.5, 3.0), generator.uniform(-pi, pi)) for _ in range(4)]
        for step in range(20):
            place.people = [beside(pose, d, a + 0.02 * step) for d, a in crowd[: episode % 5]]
            scan = place.scan(pose, 100.0 * episode + 0.1 * step, generator)
            localiser.process(HERE, scan)
            low.append(localiser.estimate.health < 0.3)
    assert np.mean(low) <= 0.01


def in_room(pose: Pose2D) -> Pose2D:
    return Pose2D(pose.x - 5.05, pose.y, pose.heading) if pose.x > 5.1 else pose


def is_kidnap(place: Place, before: Pose2D, after: Pose2D, twins: bool) -> bool:
    if not twins:
        return before.distance_to(after) >= 2.0
    before, after = in_room(before), in_room(after)
    turned = abs(wrap_angle(before.heading - after.heading))
    return before.distance_to(after) >= 1.0 or turned >= pi / 3


@pytest.mark.parametrize("twins", [False, True])
def test_a_kidnap_is_detected_within_two_seconds(twins):
    """At least 95 % of kidnaps; in the twin rooms also those into the other twin."""
    place = twin_rooms() if twins else office()
    generator = np.random.default_rng(3)
    localiser, caught = None, 0
    for _ in range(40):
        pose = place.free_pose(generator)
        localiser = settled(place, pose, generator, localiser)
        assert localiser.estimate.health > 0.5
        elsewhere = place.free_pose(generator)
        while not is_kidnap(place, pose, elsewhere, twins):
            elsewhere = place.free_pose(generator)
        odometry = HERE
        for step in range(20):
            odometry, elsewhere = odometry.compose(STEP), elsewhere.compose(STEP)
            localiser.process(odometry, place.scan(elsewhere, 1.0 + 0.1 * step, generator))
            if localiser.estimate.health < 0.3:
                caught += 1
                break
    assert caught >= 38


def test_a_lost_filter_does_not_converge_to_a_wrong_pose():
    """Drives of 8 s after each of 8 kidnaps: it is rarely both wrong and confident."""
    place, generator = twin_rooms(), np.random.default_rng(8)
    localiser, deceived, found = None, [], []
    for _ in range(8):
        pose, elsewhere = place.free_pose(generator), place.free_pose(generator)
        while not is_kidnap(place, pose, elsewhere, twins=True):
            elsewhere = place.free_pose(generator)
        localiser, odometry = settled(place, pose, generator, localiser), HERE
        for step in range(80):
            ahead = elsewhere.compose(Pose2D(0.35, 0.0))
            free = place.is_clear(ahead.x, ahead.y)
            moved = Pose2D(0.04, 0.0, 0.01 * sin(step / 7)) if free else Pose2D(0.0, 0.0, 0.07)
            odometry, elsewhere = odometry.compose(moved), elsewhere.compose(moved)
            localiser.process(odometry, place.scan(elsewhere, 1.0 + 0.1 * step, generator))
            estimate = localiser.estimate
            wrong = estimate.pose.distance_to(elsewhere) > 0.5
            if step >= 20:
                deceived.append(wrong and estimate.is_good and not estimate.ambiguous)
        poses = [estimate.pose, *(rival.pose for rival in estimate.rivals)]
        found.append(min(pose.distance_to(elsewhere) for pose in poses) < 0.15)
    assert np.mean(deceived) < 0.05
    assert sum(found) >= 7, "the right room is the estimate or a rival"


@pytest.mark.parametrize("bearing", [0.0, pi / 2, -2.5])
def test_a_person_right_in_front_does_not_lower_the_health(bearing):
    place, generator = office(), np.random.default_rng(0)
    pose = Pose2D(5.75, 2.0, 0.3)
    place.people = [beside(pose, 0.5, bearing)]
    assert settled(place, pose, generator).estimate.health > 0.3


@pytest.mark.parametrize(
    "pose", [Pose2D(2.05, 4.5, -pi / 2), Pose2D(5.75, 3.2, pi / 2), Pose2D(7.75, 4.6, pi / 2)]
)
def test_closed_doors_that_are_open_on_the_map_do_not_lower_the_health(pose):
    place, generator = office(unmapped=DOORS), np.random.default_rng(0)
    assert settled(place, pose, generator).estimate.health > 0.3


def test_a_person_who_passes_quickly_does_not_lower_the_health():
    """Three scans of ten with the lidar covered do not change the median over a second."""
    place, generator = office(), np.random.default_rng(0)
    pose = Pose2D(5.75, 2.0, 0.3)
    localiser = settled(place, pose, generator)
    place.people = [beside(pose, 0.25, a) for a in (0.0, pi / 2, pi, -pi / 2)]
    for step in range(3):
        localiser.process(HERE, place.scan(pose, 1.0 + 0.1 * step, generator))
    assert localiser.estimate.health > 0.6


def test_fit_at_evaluates_other_poses():
    place, generator = office(), np.random.default_rng(0)
    pose = Pose2D(5.75, 2.0, 0.3)
    localiser = settled(place, pose, generator)
    scan = place.scan(pose, 2.0, generator)
    assert localiser.fit_at(pose, scan) > 0.8
    assert localiser.fit_at(Pose2D(9.0, 2.8, 0.3), scan) < 0.3


def test_an_initial_pose_has_high_health_until_the_first_scan():
    place, generator = office(), np.random.default_rng(0)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 0)
    assert localiser.estimate.health == 0.0, "scattered"
    localiser.set_pose(Pose2D(5.75, 2.0), 0.1, 0.1)
    assert localiser.estimate.health == 0.8
    localiser.process(HERE, place.scan(Pose2D(9.0, 6.3, 2.0), 0.0, generator))
    assert localiser.estimate.health < 0.3
    localiser.set_pose(Pose2D(9.0, 6.3, 2.0), 0.1, 0.1)
    assert localiser.estimate.health == 0.8, "the scan before says nothing of the new pose"
    localiser.scatter()
    assert localiser.estimate.health == 0.0


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_a_scan_without_returns_does_not_move_the_pose(value):
    localiser = Localiser(LocaliserParameters(), robot(), office().grid, 0)
    pose = Pose2D(5.75, 2.0, 0.5)
    localiser.set_pose(pose, 0.02, 0.02)
    ranges = np.full(360, value, dtype=np.float32)
    localiser.process(HERE, Scan(0.0, ranges, -pi, 2 * pi / 360, 0.08, 12.0))
    assert localiser.estimate.pose.distance_to(pose) < 0.02
    assert localiser.estimate.health < 0.3


def test_calibration_on_a_map_without_free_space_has_a_fallback():
    place = office()
    place.grid.cells[:] = 100
    field = surface_field(place.grid)
    scan = Scan(0.0, np.ones(36, dtype=np.float32), -pi, 2 * pi / 36, 0.1, 12.0)
    scale = calibrate(ScanEvaluator(field, 0.01), field, scan, 0.01, 7, np.random.default_rng(0))
    assert 0.0 < scale.low < scale.middle < 1.0


def test_a_scale_for_few_obstacles_expects_a_better_fit():
    place = office()
    field = surface_field(place.grid)
    scan = place.scan(Pose2D(2.0, 2.5), 0.0, np.random.default_rng(0))
    few, usual = (
        calibrate(
            ScanEvaluator(field, 0.01), field, scan, 0.01, count,
            np.random.default_rng(0),
        )
        for count in (0, 7)
    )  # fmt: skip
    assert few.low > usual.low + 0.1
    assert usual.low == pytest.approx(0.67, abs=0.05)  # of the drawn office; see the parameter


def test_the_median_forgets_what_is_older_than_its_window():
    recent = RecentViews()
    assert recent.median is None
    for stamp, value in ((0.0, 9.0), (0.5, 1.0), (1.0, 2.0), (1.2, 3.0)):
        recent.add(stamp, ScanView(value, 0.0, 0.0, -value))
    assert recent.median == ScanView(2.0, 0.0, 0.0, -2.0)
    assert recent.newest == ScanView(3.0, 0.0, 0.0, -3.0)


def test_the_stated_deviation_is_a_factor_of_the_health():
    """Along a corridor each pose fits: 68 and 95 % are within 0.3 m at one and two deviations."""
    fits = ScanView(0.95, 0.0, 0.0, 0.0)
    wide, narrow = (
        HealthFeatures(fits, fits, FitScale(0.6, 0.9), deviation, 1.0) for deviation in (0.3, 0.15)
    )
    assert wide.within == pytest.approx(0.6827, abs=1e-4)
    assert narrow.within == pytest.approx(0.9545, abs=1e-4)
    assert health(wide) / health(narrow) == pytest.approx(0.6827 / 0.9545, abs=1e-3)
