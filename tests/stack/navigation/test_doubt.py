"""A robot with an uncertain pose stands: a path from a wrong pose is useless."""

from math import inf

import numpy as np
import pytest

from stack.control.checkers import LostChecker
from stack.types import Pose2D, PoseEstimate, RivalPose

HERE = Pose2D(0.0, 0.0)


def estimate(health: float, *, rivals: tuple[float, ...] = (), obscured: bool = False):
    others = tuple(RivalPose(HERE, share) for share in rivals)
    return PoseEstimate(HERE, np.eye(3), health, rivals=others, obscured=obscured)


def test_doubt_begins_with_the_first_low_health_and_ends_with_a_good_one():
    checker = LostChecker(1.5)
    assert not checker.doubted
    assert not checker.lost(0.0, estimate(0.29), HERE)
    assert checker.doubted
    assert not checker.lost(0.5, estimate(0.31), HERE)
    assert not checker.doubted


def test_ambiguity_alone_is_not_being_lost():
    """A health of 0.2 with three equal rivals: each fits with 0.8."""
    assert not estimate(0.2, rivals=(0.25, 0.25, 0.25)).is_lost
    assert estimate(0.2).is_lost


def test_unmapped_things_let_a_drive_go_on_slowly_for_a_distance():
    checker = LostChecker(1.5, speed=0.2, distance=1.0)
    hidden = estimate(0.1, obscured=True)
    for step in range(10):
        assert not checker.lost(0.1 * step, hidden, Pose2D(0.1 * step, 0.0))
        assert not checker.doubted
        assert checker.speed_limit == 0.2
    checker.lost(1.1, hidden, Pose2D(1.1, 0.0))
    assert checker.doubted, "a metre has been driven"
    assert checker.lost(2.7, hidden, Pose2D(1.1, 0.0))
    checker.lost(3.0, estimate(0.9), Pose2D(1.1, 0.0))
    assert checker.speed_limit == inf
    checker.lost(3.1, hidden, Pose2D(1.1, 0.0))
    assert checker.speed_limit == 0.2, "a good pose begins a new distance"


@pytest.mark.parametrize(("seconds", "lost"), [(1.4, False), (1.5, True)])
def test_doubt_that_lasts_is_being_lost(seconds, lost):
    checker = LostChecker(1.5)
    checker.lost(10.0, estimate(0.1), HERE)
    assert checker.lost(10.0 + seconds, estimate(0.1), HERE) is lost
