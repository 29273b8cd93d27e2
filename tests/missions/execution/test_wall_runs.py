"""Mission 04 along either side; the run along the right one serves two tests."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from tests.benchmarks.missions import wall_error, wall_run
from tests.missions.shipped import check_success

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", autouse=True)
def along_the_right():
    """Report and trace; `wall_run` keeps them for `wall_error`."""
    return wall_run(("right", 1))


def test_the_shipped_mission_succeeds_without_a_collision(along_the_right):
    check_success("04_wall_follow", asdict(along_the_right[0]))


@pytest.mark.parametrize("side", ["right", "left"])
def test_wall_following_keeps_its_distance_within_5_cm_rms_on_straight_walls(side):
    row = wall_error((side, 1))
    assert row["status"] == "success"
    assert row["samples"] > 100
    assert row["rms"] < 0.05
