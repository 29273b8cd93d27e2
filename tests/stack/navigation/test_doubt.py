"""A robot with an uncertain pose stands: a path from a wrong pose is useless."""

import pytest

from stack.control.checkers import LostChecker


def test_doubt_begins_with_the_first_low_health_and_ends_with_a_good_one():
    checker = LostChecker(0.3, 1.5)
    assert not checker.doubted
    assert not checker.lost(0.0, 0.29)
    assert checker.doubted
    assert not checker.lost(0.5, 0.31)
    assert not checker.doubted


@pytest.mark.parametrize(("seconds", "lost"), [(1.4, False), (1.5, True)])
def test_doubt_that_lasts_is_being_lost(seconds, lost):
    checker = LostChecker(0.3, 1.5)
    checker.lost(10.0, 0.1)
    assert checker.lost(10.0 + seconds, 0.1) is lost
