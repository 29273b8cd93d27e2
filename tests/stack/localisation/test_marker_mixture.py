"""The likelihood of markers against closed forms of normal distributions."""

from math import log, pi

import numpy as np
import pytest

from stack.localisation.marker_mixture import Mixture, carried
from stack.types import Pose2D, PoseCandidate

VOLUME = 100.0
PRIOR = np.diag([0.04, 0.01, 0.0025])


def candidate(pose, covariance, share):
    return PoseCandidate(pose, 0.0, covariance, share)


def single(pose, variances, outliers=1e-9):
    return Mixture([candidate(pose, np.diag(variances), 1.0)], VOLUME, outliers)


def test_one_candidate_is_a_kalman_filter():
    """Gain 0.04 / (0.04 + 0.04) along x, 0.01 / 0.02 along y, 0.0025 / 0.005 of the heading."""
    mixture = single(Pose2D(1.2, 2.1, 0.06), [0.04, 0.01, 0.0025])
    pose, covariance = mixture.posterior(Pose2D(1.0, 2.0, 0.0), PRIOR)
    assert (pose.x, pose.y, pose.heading) == pytest.approx((1.1, 2.05, 0.03), abs=1e-6)
    assert covariance == pytest.approx(0.5 * PRIOR, abs=1e-6)


def test_headings_wrap_round():
    mixture = single(Pose2D(0.0, 0.0, -pi + 0.1), [0.04, 0.01, 0.0025])
    pose, _ = mixture.posterior(Pose2D(0.0, 0.0, pi - 0.1), PRIOR)
    assert abs(pose.heading) == pytest.approx(pi, abs=1e-6)


def test_a_false_measurement_changes_nothing():
    """5 m from a prior of 0.2 m: the density of a false measurement is higher by far."""
    mixture = single(Pose2D(5.0, 0.0), [0.01, 0.01, 0.001], outliers=0.02)
    prior = Pose2D(0.0, 0.0)
    evidence, shares = mixture.evidence(prior, PRIOR)
    assert shares == pytest.approx([0.0, 1.0], abs=1e-9)
    assert evidence == pytest.approx(log(0.02 / VOLUME))
    pose, covariance = mixture.posterior(prior, PRIOR)
    assert pose.distance_to(prior) < 1e-6
    assert covariance == pytest.approx(PRIOR, abs=1e-6)


def test_the_prior_chooses_between_mirrored_candidates():
    near = candidate(Pose2D(0.1, 0.0), np.diag([0.01, 0.01, 0.001]), 0.4)
    mirrored = candidate(Pose2D(0.9, 0.5), np.diag([0.01, 0.01, 0.001]), 0.6)
    mixture = Mixture([mirrored, near], VOLUME)
    _, shares = mixture.evidence(Pose2D(0.0, 0.0), PRIOR)
    assert shares[1] > 0.99
    pose, _ = mixture.posterior(Pose2D(0.0, 0.0), PRIOR)
    assert pose.distance_to(Pose2D(0.08, 0.0)) < 0.02  # gain 0.04 / 0.05


def test_a_displacement_carries_the_error_of_the_heading():
    """1 m ahead, 0.1 rad of heading are 0.1 m to the side; the noise of the motion is added."""
    start = candidate(Pose2D(0.0, 0.0, pi / 2), np.diag([0.0, 0.0, 0.01]), 1.0)
    moved = carried(start, Pose2D(1.0, 0.0), np.diag([0.04, 0.0, 0.0]))
    assert (moved.pose.x, moved.pose.y) == pytest.approx((0.0, 1.0))
    assert moved.covariance[0, 0] == pytest.approx(0.01)
    assert moved.covariance[1, 1] == pytest.approx(0.04)  # forward is y
    assert moved.covariance[0, 2] == pytest.approx(-0.01)


def test_likelihoods_of_particles_are_the_mixture_density():
    mixture = single(Pose2D(0.0, 0.0), [0.01, 0.01, 0.01], outliers=0.02)
    logs = mixture.log_likelihoods(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [9.0, 0.0, 0.0]]))
    peak = log(0.98) - 0.5 * 3 * log(2 * pi * 0.01)
    assert logs[0] == pytest.approx(peak, abs=1e-3)
    assert logs[0] - logs[1] == pytest.approx(0.5, abs=1e-3)
    assert logs[2] == pytest.approx(log(0.02 / VOLUME))


def test_two_candidates_far_apart_inform_little():
    sharp = single(Pose2D(0.0, 0.0), [0.01, 0.01, 0.01]).information(np.array([1.0, 0.0]))
    assert np.diag(sharp) == pytest.approx([100.0] * 3)
    both = [candidate(Pose2D(x, 0.0), np.diag([0.01] * 3), 0.5) for x in (-1.0, 1.0)]
    wide = Mixture(both, VOLUME).information(np.array([0.5, 0.5, 0.0]))
    assert wide[0, 0] == pytest.approx(1.0 / 1.01)
    assert wide[1, 1] == pytest.approx(100.0)
