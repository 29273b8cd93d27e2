"""The particle filter driving through a drawn office with drifting odometry."""

from itertools import pairwise
from math import cos, pi, sin

import numpy as np
import pytest

from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.particle_filter.particles import kld_bound
from stack.types import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, Pose2D, wrap_angle
from tests.stack.localisation.drawn_office import Drifting, along, office
from tests.stack.navigation.toy_world import robot

TOUR = [
    (2.0, 2.5), (2.05, 4.5), (2.6, 5.0), (2.6, 6.5), (2.6, 4.6), (5.75, 4.5), (5.75, 2.0),
    (5.75, 4.5), (7.75, 4.6), (7.75, 6.0), (9.6, 6.3), (10.2, 7.8),
]  # fmt: skip


def covered(grid: OccupancyGrid, factor: int, shift: int) -> OccupancyGrid:
    """A map with larger cells, each occupied if any part of it is; its edges are shifted."""
    cells = np.pad(grid.cells, shift, constant_values=UNKNOWN)
    cells = np.pad(cells, [(0, -side % factor) for side in cells.shape], constant_values=UNKNOWN)
    rows, columns = (side // factor for side in cells.shape)
    blocks = cells.reshape(rows, factor, columns, factor).swapaxes(1, 2).reshape(rows, columns, -1)
    coarse = np.where((blocks == FREE).any(axis=2), FREE, UNKNOWN).astype(np.int8)
    coarse[(blocks == OCCUPIED).any(axis=2)] = OCCUPIED
    corner = (grid.origin[0] - shift * grid.resolution, grid.origin[1] - shift * grid.resolution)
    return OccupancyGrid(coarse, grid.resolution * factor, corner)


class Drive:
    """Run the filter on a drive; return its results step by step."""

    def __init__(self, seed: int, *, crowd: bool = False, factor: int = 1, shift: int = 0) -> None:
        self.generator = np.random.default_rng(seed)
        self.place = office()
        grid = covered(self.place.grid, factor, shift)
        self.localiser = Localiser(LocaliserParameters(), robot(), grid, seed)
        self.odometry = Drifting(self.generator)
        self.errors: list[float] = []
        self.turned: list[float] = []
        self.qualities: list[float] = []
        self.crowd = crowd

    def go(self) -> None:
        self.localiser.process(self.odometry.pose, None)
        self.localiser.set_pose(Pose2D(*TOUR[0], 0.6), 0.15, 0.1)
        people = [self.place.free_pose(self.generator) for _ in range(5)]
        for step, (pose, moved) in enumerate(along(TOUR, 0.5, 0.5, 0.1)):
            now = 0.1 * step
            if self.crowd:
                self.place.people = [
                    (p.x + 0.5 * sin(now + i), p.y + 0.5 * cos(0.7 * now + i), 0.2)
                    for i, p in enumerate(people)
                ]
                near = (pose.x + 0.7 * cos(now / 3), pose.y + 0.7 * sin(now / 3), 0.2)
                self.place.people.append(near)
            scan = self.place.scan(pose, now, self.generator)
            self.localiser.process(self.odometry.move(moved, 0.1), scan)
            estimate = self.localiser.estimate
            self.errors.append(estimate.pose.distance_to(pose))
            self.turned.append(abs(wrap_angle(estimate.pose.heading - pose.heading)))
            self.qualities.append(estimate.health)


@pytest.mark.parametrize("crowd", [False, True])
def test_the_pose_stays_within_the_target(crowd):
    """Target of an office at a 5 cm map with 1 cm lidar noise: mean 3 cm, at most 10 cm."""
    drive = Drive(seed=4, crowd=crowd)
    drive.go()
    drifted = abs(drive.odometry.scale - 1.0) * 30.0
    assert np.mean(drive.errors) < 0.03
    assert max(drive.errors) < 0.10
    assert np.mean(drive.turned) < 0.01
    assert drifted > 0.1, "the drift that is to be corrected"


@pytest.mark.parametrize(("factor", "shift"), [(2, 1), (4, 0), (4, 3)])
def test_a_map_of_coarse_covered_cells_is_followed(factor, shift):
    """Cells of 10 and 20 cm: walls are up to a cell off, and the robot is never lost."""
    drive = Drive(seed=4, factor=factor, shift=shift)
    drive.go()
    assert min(drive.qualities) > LocaliserParameters().lost_health
    assert max(drive.errors) < 0.05 * factor


def test_the_same_seed_gives_the_same_pose_bit_by_bit():
    one, other = Drive(seed=7), Drive(seed=7)
    one.go()
    other.go()
    assert one.localiser.estimate.pose == other.localiser.estimate.pose
    assert np.array_equal(one.localiser.particles, other.localiser.particles)


def test_between_scans_the_pose_is_propagated_by_odometry():
    localiser = Localiser(LocaliserParameters(), robot(), office().grid, 0)
    localiser.process(Pose2D(5.0, 5.0, pi / 2), None)
    localiser.set_pose(Pose2D(1.0, 2.0, 0.0), 0.0, 0.0)
    localiser.process(Pose2D(5.0, 6.0, pi / 2), None)
    # one metre ahead in the odom frame is one metre ahead in the map frame
    assert localiser.estimate.pose.distance_to(Pose2D(2.0, 2.0)) < 1e-9
    assert np.allclose(localiser.particles.mean(axis=0), [2.0, 2.0, 0.0])


def test_started_before_the_first_odometry():
    localiser = Localiser(LocaliserParameters(), robot(), office().grid, 0)
    localiser.set_pose(Pose2D(1.0, 2.0, 0.5), 0.0, 0.0)
    localiser.process(Pose2D(-3.0, 4.0, 2.0), None)
    assert localiser.estimate.pose.distance_to(Pose2D(1.0, 2.0)) < 1e-9
    assert localiser.estimate.pose.heading == pytest.approx(0.5)


def test_start_spreads_the_particles_by_the_deviations():
    localiser = Localiser(LocaliserParameters(), robot(), office().grid, 0)
    localiser.set_pose(Pose2D(6.0, 4.5, 1.0), 0.3, 0.2)
    estimate = localiser.estimate
    # standard deviation of n draws is known to about 1/sqrt(2 n), n >= 300: 4 %
    assert estimate.position_deviation == pytest.approx(0.3, rel=0.15)
    assert estimate.heading_deviation == pytest.approx(0.2, rel=0.15)


def test_one_scan_aligns_a_rough_start():
    """Started 10 cm off: the particles are 2 cm off after one scan, after alignment 1 cm."""
    place, generator = office(), np.random.default_rng(6)
    localiser, errors = Localiser(LocaliserParameters(), robot(), place.grid, 6), []
    for step in range(40):
        pose = place.free_pose(generator)
        localiser.set_pose(pose.compose(Pose2D(0.08, -0.06, 0.03)), 0.1, 0.05)
        localiser.process(Pose2D(0.0, 0.0), place.scan(pose, float(step), generator))
        errors.append(localiser.estimate.pose.distance_to(pose))
    assert np.median(errors) < 0.015


@pytest.mark.parametrize("moved", [Pose2D(0.06, 0.0), Pose2D(0.0, 0.0, 0.06)])
def test_once_settled_scans_weigh_only_after_moving(moved):
    """Standing, the first scan weighs; then none does before 0.05 m or 0.05 rad have gone."""
    place, generator = office(), np.random.default_rng(5)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 5)
    pose = Pose2D(5.75, 2.0, 0.3)
    half = Pose2D(moved.x / 2, moved.y / 2, moved.heading / 2)
    localiser.process(Pose2D(0.0, 0.0), None)
    localiser.set_pose(pose, 0.03, 0.03)
    spreads = []
    for step, at in enumerate([Pose2D(0.0, 0.0)] * 4 + [half, moved]):
        localiser.process(at, place.scan(pose.compose(at), 0.1 * step, generator))
        spreads.append(localiser.estimate.covariance)
    weighed = [not np.array_equal(a, b) for a, b in pairwise(spreads)]
    assert weighed == [False, False, False, False, True]


def test_scattered_particles_find_the_robot():
    place, generator = office(), np.random.default_rng(11)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 11)
    odometry = Drifting(generator)
    assert localiser.estimate.position_deviation > 2.0
    for step, (pose, moved) in enumerate(along(TOUR, 0.5, 0.5, 0.1)):
        scan = place.scan(pose, 0.1 * step, generator)
        localiser.process(odometry.move(moved, 0.1), scan)
    assert localiser.estimate.pose.distance_to(pose) < 0.1
    assert localiser.estimate.position_deviation < 0.1
    assert localiser.particles.shape[0] < 600, "fewer particles once it is sure"


def test_kld_bound_against_the_formula_by_hand():
    """k = 2 bins: (k-1)/(2e) (1 - 2/9 + sqrt(2/9) 2.33)^3 = 10 * 1.87615^3 = 66.04."""
    two = np.array([[0.1, 0.1, 0.01], [3.0, 0.1, 0.01]])
    assert kld_bound(two, 0.05, 2.33) == 66
    assert kld_bound(two[:1], 0.05, 2.33) == 1


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_bins_are_told_apart_along_every_axis(axis):
    """k = 11: 10 / 0.1 (1 - 2/90 + sqrt(2/90) 2.33)^3 = 100 * 1.32512^3 = 232.68."""
    poses = np.tile([0.1, 0.1, 0.01], (11, 1))
    poses[:, axis] += np.arange(11) * (0.5, 0.5, pi / 18)[axis]
    assert kld_bound(poses, 0.05, 2.33) == 232


def test_headings_a_full_turn_apart_share_a_bin():
    poses = np.array([[0.1, 0.1, 0.01 + turns * 2.0 * pi] for turns in (-1, 0, 1)])
    assert kld_bound(poses, 0.05, 2.33) == 1
