"""Speed limits by place: zones ahead, masks, and limits that no costmap has to show."""

from math import inf, pi, sqrt

import numpy as np
import pytest

from stack.costmap.speed_limits import SpeedLimitParameters, SpeedLimits
from stack.errors import InputError, ParameterError
from stack.parameters import build
from stack.types import FREE, OccupancyGrid, Pose2D, Twist
from tests.stack.mapping.written_maps import write_ros_map

SQUARE = [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0]]


def limits(**values):
    return SpeedLimits(build(SpeedLimitParameters, values))


def test_a_zone_is_entered_at_its_speed_and_braked_for_in_time():
    found = limits(zones=[{"corners": SQUARE, "speed": "0.3 m/s"}])
    assert found.at_pose(Pose2D(1.5, 0.5, 1.0), 1.0) == pytest.approx(0.3)
    # 0.5 m before it, seen at the first step inside: v² = 0.3² + 2 · 1.0 · 0.5
    before = found.at_pose(Pose2D(0.501, 0.5), 1.0)
    assert before == pytest.approx(sqrt(0.09 + 2 * 1.0 * 0.5), abs=1e-6)
    assert found.at_pose(Pose2D(0.5, 0.5, pi), 1.0) == inf
    assert limits().at_pose(Pose2D(1.5, 0.5), 1.0) == inf


@pytest.mark.parametrize(
    ("heading", "twist"),
    [
        (pi, Twist(-0.5)),  # backs towards it
        (pi / 2.0, Twist(lateral=-0.5)),  # to the right
        (-pi / 4.0, Twist(0.3, lateral=0.3)),
        (0.0, Twist(0.01, lateral=0.01)),  # stands
    ],
)
def test_zones_in_the_direction_of_motion_are_braked_for(heading, twist):
    found = limits(zones=[{"corners": SQUARE, "speed": "0.3 m/s"}])
    limit = found.at_pose(Pose2D(0.501, 0.5, heading), 1.0, twist)
    assert limit == pytest.approx(sqrt(0.09 + 2 * 1.0 * 0.5), abs=1e-6)
    away = found.at_pose(Pose2D(0.501, 0.5, heading + pi), 1.0, twist)
    assert away == inf


def test_a_mask_gives_percent_of_full_speed(tmp_path):
    mask = OccupancyGrid(np.full((20, 20), FREE, dtype=np.int8), 0.05)
    mask.cells[:, 10:] = 40
    write_ros_map(mask, tmp_path / "speed.yaml")
    parameters = build(SpeedLimitParameters, {"mask": "speed.yaml", "full_speed": 2.0})
    found = SpeedLimits(parameters.located(tmp_path))
    assert found.at_pose(Pose2D(0.75, 0.5), 1.0) == pytest.approx(0.8)
    assert found.at_pose(Pose2D(0.25, 0.5, pi), 1.0) == inf
    with pytest.raises(InputError, match=r"speed_limits: mask file speed.yaml does not exist"):
        parameters.located(tmp_path / "elsewhere")


def test_a_speed_with_a_wrong_unit_is_reported():
    with pytest.raises(ParameterError, match="expected a number in m/s"):
        limits(zones=[{"corners": SQUARE, "speed": "3 m"}])
