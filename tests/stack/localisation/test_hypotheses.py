"""Hypotheses keep places that look alike, and drop those that the evidence rejects."""

from math import exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.localisation.particle_filter import hypotheses as particle_hypotheses
from stack.localisation.particle_filter.hypotheses import Hypotheses, Hypothesis, largest_deviation
from stack.localisation.particle_filter.particles import ParticleSet
from stack.types import Pose2D


@pytest.fixture(autouse=True)
def thresholds(monkeypatch):
    for name, value in {"RIVAL_DEAD_ZONE": 1.5, "RIVAL_SHARE": 0.02, "MAX_HYPOTHESES": 5}.items():
        monkeypatch.setattr(particle_hypotheses, name, value)


def at(x: float, log_weight: float = 0.0) -> Hypothesis:
    poses = np.tile([x, 0.0, 0.0], (10, 1))
    return Hypothesis(ParticleSet.uniform(poses), Pose2D(x, 0.0), 0.01 * np.eye(3), log_weight)


def places(*logs: float) -> Hypotheses:
    hypotheses = Hypotheses()
    hypotheses.replace([at(5.0 * k, log) for k, log in enumerate(logs)])
    return hypotheses


def test_a_difference_within_the_dead_zone_is_no_evidence():
    hypotheses = places(0.0, 0.0)
    for _ in range(1000):
        hypotheses.travel(1.0)
        hypotheses.weigh([3.0, 4.4])
    assert hypotheses.shares == pytest.approx([0.5, 0.5])


def test_one_view_counts_once_however_long_the_robot_stands():
    """Costs differ by 3.5, 2 beyond the dead zone: shares 1 to exp(-2) for the whole view."""
    hypotheses = places(0.0, 0.0)
    for _ in range(100):
        hypotheses.weigh([1.0, 4.5])
    assert hypotheses.shares[1] / hypotheses.shares[0] == pytest.approx(exp(-2.0))
    hypotheses.travel(0.5)
    for _ in range(100):
        hypotheses.weigh([1.0, 4.5])
    assert hypotheses.shares[1] / hypotheses.shares[0] == pytest.approx(exp(-3.0)), (
        "half a new view"
    )


def test_a_rival_takes_over_and_the_old_place_is_dropped():
    hypotheses = places(0.0, 0.0)
    before = hypotheses.best
    hypotheses.weigh([20.0, 1.0])  # a quarter of a view: exp(15 / 4) = 42
    assert hypotheses.tidy()
    assert hypotheses.best is not before
    hypotheses.weigh([1.0, 20.0])
    assert not hypotheses.tidy()
    assert len(hypotheses) == 1


def test_a_rival_that_is_hardly_more_probable_does_not_take_over():
    hypotheses = places(0.0, 0.5)
    assert not hypotheses.tidy()
    assert [rival.share for rival in hypotheses.rivals(Pose2D(0.0, 0.0))] == pytest.approx(
        [exp(0.5) / (1.0 + exp(0.5))]
    )


def test_hypotheses_that_meet_become_one():
    hypotheses = places(0.0, 0.0)
    hypotheses.others[0].follow(Pose2D(0.1, 0.1))
    hypotheses.tidy()
    assert len(hypotheses) == 1
    assert not hypotheses.add(at(0.1)), "the same place"
    assert hypotheses.add(at(3.0))


def test_the_covariance_includes_the_rivals():
    """Equal hypotheses 5 m apart: 0.5 * 5² about the first, plus their own 0.01."""
    assert places(0.0, 0.0).covariance()[0, 0] == pytest.approx(12.51)


@given(st.floats(0.0, 9.0), st.floats(0.0, 9.0), st.floats(-0.99, 0.99))
def test_the_largest_deviation_is_the_root_of_the_largest_eigenvalue(a, d, correlation):
    b = correlation * (a * d) ** 0.5
    covariance = np.array([[a, b, 0.0], [b, d, 0.0], [0.0, 0.0, 1.0]])
    largest = np.linalg.eigvalsh(covariance[:2, :2])[-1]
    assert largest_deviation(covariance) == pytest.approx(max(0.0, largest) ** 0.5, abs=1e-6)


def test_a_place_that_does_not_fit_well_cannot_take_over():
    hypotheses = places(0.0, 4.0, 3.0)
    hypotheses.hold_back([False, True])
    assert hypotheses.tidy() and hypotheses.best.pose.x == pytest.approx(10.0)


def test_a_place_that_was_just_found_is_compared_before_it_is_left_out():
    hypotheses = places(0.0, -0.7, -0.7, -0.7, -0.7, -0.7, -2.0)
    newest = hypotheses.others[-1]
    newest.weighed = 0.0
    hypotheses.tidy()
    assert len(hypotheses) == 5
    assert any(hypothesis is newest for hypothesis in hypotheses)
