"""Odometry since the last measurement update, and when the next one is due."""

from math import pi

import numpy as np
import pytest

from stack.localisation.particle_filter.odometry_since import MotionSince, OdometrySince
from stack.types import Pose2D


def test_the_error_of_two_motions_includes_the_lever_of_the_first_heading_error():
    """0.1 rad before 2 m ahead: 0.2 m across. The second error is turned with the first motion."""
    first = MotionSince.none().then(Pose2D(0.0, 0.0, pi / 2), np.diag([0.0, 0.0, 0.01]), False)
    both = first.then(Pose2D(2.0, 0.0), np.diag([0.09, 0.0, 0.0]), True)
    # ahead is now y of the start's frame: the lever moves x by -2 * 0.1, and y has 0.09
    assert both.covariance[0, 0] == pytest.approx(0.04)
    assert both.covariance[1, 1] == pytest.approx(0.09)
    assert both.covariance[0, 2] == pytest.approx(-0.02)
    assert both.disturbed


@pytest.mark.parametrize(("settled", "due"), [(True, [1, 0, 0]), (False, [1, 1, 0])])
def test_a_view_from_one_place_counts_once_and_twice_while_uncertain(settled, due):
    since = OdometrySince()
    since.add(Pose2D(1.0, 2.0, 0.5))
    assert [since.is_update_due(settled=settled) for _ in due] == due


@pytest.mark.parametrize("moved", [Pose2D(0.1, 0.0), Pose2D(0.0, 0.0, -0.1)])
def test_an_update_is_due_after_the_distance_or_the_angle(moved):
    since, start = OdometrySince(), Pose2D(1.0, 2.0, pi / 2)
    since.add(start)
    since.add_scan(0.0, None, disturbed=False)
    assert since.is_update_due(settled=True)
    assert not since.is_update_due(settled=True)
    since.add(start.compose(moved))
    travelled = abs(moved.x), abs(moved.heading)
    assert since.add_scan(0.1, None, disturbed=True) == pytest.approx(travelled, abs=1e-12)
    assert since.is_update_due(settled=True)
    motion = since.take()
    assert motion.disturbed and motion.moved.distance_to(moved) < 1e-12
    assert since.moved.distance_to(Pose2D(0.0, 0.0)) < 1e-12 and not since.stated.disturbed
