"""Least covariance of a pose: grows with the motion where scans observe nothing."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.particle_filter.motion_models import (
    CarMotionNoise,
    MotionNoise,
    OmniMotionNoise,
)
from stack.localisation.particle_filter.uncertainty import (
    LeastCovariance,
    observable,
    stretch,
    widened,
)
from stack.types import Pose2D
from tests.stack.localisation.drawn_office import Drifting, Place, drawn, mapped
from tests.stack.navigation.toy_world import robot

NO_NOISE = np.zeros((3, 3))


def test_an_unknown_scale_grows_with_the_distance_and_noise_with_its_root():
    least, noise = LeastCovariance.of(NO_NOISE), np.diag([0.0, 0.02**2, 0.0])
    for _ in range(25):
        least = least.moved(pi / 2.0, Pose2D(0.4, 0.0), noise, 0.01)
    # 1 % of 10 m along y; 2 cm √25 across
    assert np.sqrt(np.diag(least.pose)) == pytest.approx([0.1, 0.1, 0.0], abs=1e-9)
    assert least.scale == pytest.approx([0.0, 10.0 * 0.01**2, 0.0], abs=1e-12)


def test_a_heading_error_turns_the_motion():
    least = LeastCovariance.of(np.diag([0.0, 0.0, 0.1**2]))
    least = least.moved(0.0, Pose2D(2.0, 0.0), NO_NOISE, 0.0)
    assert least.pose[1, 1] == pytest.approx(0.2**2)
    assert least.pose[1, 2] == pytest.approx(0.2 * 0.1)


def test_what_a_scan_observes_shrinks_and_the_rest_stays():
    least = LeastCovariance(np.diag([0.04, 0.09, 0.01]), np.array([0.002, 0.003, 0.0]))
    seen = least.observed(np.diag([0.0, 100.0, 0.0]))
    # 1 / (1 / 0.09 + 100) = 0.009; the covariance with the scale shrinks alike
    assert np.diag(seen.pose) == pytest.approx([0.04, 0.009, 0.01])
    assert seen.scale == pytest.approx([0.002, 0.0003, 0.0])


def test_a_correction_keeps_only_what_is_observed():
    least = LeastCovariance.of(np.diag([0.04, 0.01, 0.0001]))
    corridor = np.diag([0.0, 5000.0, 20000.0])
    assert least.shift(np.array([0.3, 0.02, 0.01]), corridor) == pytest.approx([0.0, 0.02, 0.01])


def test_stray_points_along_a_corridor_observe_nothing():
    across = np.diag([0.5, 60.0, 100.0])  # of 60 points half a point is seen from the front
    assert observable(across, 60)[0, 0] == 0.0
    assert observable(across, 60)[1, 1] == pytest.approx(59.4)


@given(seed=st.integers(0, 10_000), size=st.floats(0.1, 10.0))
def test_particles_are_at_least_as_wide_as_they_must_be(seed, size):
    generator = np.random.default_rng(seed)
    directions, _ = np.linalg.qr(generator.normal(0.0, 1.0, (3, 3)))
    deviations = generator.uniform(0.02, 0.1, (3, 1))
    poses = generator.normal(0.0, 1.0, (60, 3)) @ (deviations * directions)
    mean, covariance = poses.mean(axis=0), np.cov(poses.T, bias=True)
    root = generator.normal(0.0, 0.03 * size, (3, 3))
    least = root @ root.T
    matrix = stretch(covariance, least, 1e6 * np.eye(3))
    wide = poses if matrix is None else widened(poses, mean, matrix)
    after = np.cov(wide.T, bias=True)
    assert wide.mean(axis=0) == pytest.approx(mean, abs=1e-9)
    for other in (covariance, least):
        assert np.linalg.eigvalsh(after - other / 1.05).min() > -1e-5


@pytest.mark.parametrize(
    "model",
    [
        MotionNoise(0.02, 0.035),
        OmniMotionNoise(0.02),
        CarMotionNoise(0.02),
    ],
)
@pytest.mark.parametrize("moved", [Pose2D(0.2, 0.02, 0.2), Pose2D(-0.1, 0.01, -0.1)])
def test_the_covariance_of_a_motion_model_is_that_of_its_samples(model, moved):
    sampled = model.sample(np.zeros((20_000, 3)), moved, np.random.default_rng(0))
    expected = model.covariance(moved)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # The standard error of a variance of 20 000 samples is 1 %; second order adds 1 %.
    assert np.cov(sampled.T) / scale == pytest.approx(expected / scale, abs=0.05)


def corridor() -> Place:
    """40 m between walls; the lidar sees 12 m."""
    walls = [(0.0, 0.0, 40.0, 0.12), (0.0, 2.03, 40.0, 2.1), (0.0, 0.0, 0.1, 2.1)]
    solid = drawn([*walls, (39.9, 0.0, 40.0, 2.1)], 40.0, 2.1)
    return Place(solid, mapped(solid))


def test_along_a_corridor_the_error_is_contained_until_its_end_is_seen():
    place, generator = corridor(), np.random.default_rng(3)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 0)
    truth, odometry = Pose2D(13.0, 1.05), Drifting(generator)
    odometry.scale, odometry.turn_rate = 1.015, 0.0
    localiser.process(odometry.pose)
    localiser.set_pose(truth, 0.02, 0.01)
    step, along, contained = Pose2D(0.1, 0.0), [], []
    for n in range(230):
        truth = truth.compose(step)
        localiser.process(odometry.move(step, 0.1), place.scan(truth, 0.1 * n, generator))
        estimate = localiser.estimate
        deviations = np.sqrt(np.diag(estimate.covariance))
        assert estimate.health >= localiser.parameters.good_health  # no drive stops for it
        along.append(deviations[0])
        contained.append(abs(estimate.pose.x - truth.x) < 2.0 * deviations[0])
        assert deviations[1] < 0.03
        assert abs(estimate.pose.y - truth.y) < 2.0 * deviations[1]
    # After 13 m: scale 1 % 0.13 m, noise √(0.02 · 0.1 m · 13 m) = 0.16 m.
    assert along[130] == pytest.approx(0.21, abs=0.03)
    assert np.mean(contained) > 0.95
    assert along[-1] < 0.06
    assert estimate.pose.distance_to(truth) < 0.1
