"""Places to turn to a goal's heading, against a search of every cell."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from stack.navigation.people.backing_out import TURNING_ROOM
from stack.navigation.plans.turning_place import TURNING_DISTANCE as REACH
from stack.navigation.plans.turning_place import turning_place
from stack.types import INSCRIBED_COST, CostGrid, Pose2D
from tests.stack.navigation.toy_world import outline

ROBOT, AT = outline(0.2, 0.32), Pose2D(0.0, 0.0)
BESIDE = [[0.0, -0.3]]
"""What keeps a robot at the origin from turning there."""
FREE = CostGrid(np.zeros((60, 60), np.uint8), 0.05, (0.0, 0.0))
WALL = np.vstack([np.column_stack([np.arange(0.0, 3.0, 0.02), np.full(150, 1.0)]), BESIDE])
"""Along x at y = 1 m."""


def test_beside_a_wall_it_is_as_far_as_the_corners_need():
    """Cells above y = 1 + 0.32 + 0.03 + 0.05 have their centres at 1.425 m and farther away."""
    place = turning_place(Pose2D(1.525, 1.225, 0.7), AT, FREE, WALL, ROBOT, REACH)
    assert (place.x, place.y, place.heading) == (pytest.approx(1.525), pytest.approx(1.425), 0.7)


@pytest.mark.parametrize(("y", "reach"), [(1.225, 0.1), (1.075, REACH), (1.225, 0.0)])
def test_there_is_none_beyond_the_reach(y, reach):
    """The row at 1.375 m is 15 cm away from a goal at 1.225 m, 30 cm from one at 1.075 m."""
    assert turning_place(Pose2D(1.525, y), AT, FREE, WALL, ROBOT, reach) is None


def test_where_it_can_turn_it_stays():
    goal = Pose2D(1.525, 1.225, 0.7)
    place = turning_place(goal, Pose2D(1.6, 1.36, 2.0), FREE, np.array([[0.0, 0.36]]), ROBOT, REACH)
    assert place == Pose2D(1.6, 1.36, 0.7)


@given(
    st.integers(0, 999), st.integers(0, 40), st.floats(0.1, 2.9), st.floats(0.1, 2.9),
    st.sampled_from([0.0, 0.1, 0.2, 0.4]),
)  # fmt: skip
@example(seed=47, count=32, x=1.09375, y=1.1875, reach=0.1)
@settings(deadline=None, max_examples=60)
def test_it_is_the_nearest_cell_that_fits(seed, count, x, y, reach):
    random = np.random.default_rng(seed)
    points = random.uniform(0.0, 3.0, (count, 2))
    cells = np.where(random.random((60, 60)) < 0.2, INSCRIBED_COST, 0).astype(np.uint8)
    costs, goal = CostGrid(cells, 0.05, (0.0, 0.0)), Pose2D(x, y, 0.3)
    place = turning_place(goal, AT, costs, np.vstack([points, BESIDE]), ROBOT, reach)
    cells_that_fit = {}
    for row, column in np.argwhere(cells < INSCRIBED_COST):
        at = np.array(costs.centre_of(int(row), int(column)))
        room = np.hypot(*([*points, *BESIDE] - at).T).min()
        for least in (0.35, 0.4):
            if room > least and np.hypot(*(at - (x, y))) <= reach:
                cells_that_fit.setdefault(least, []).append(np.hypot(*(at - (x, y))))
    away = min(cells_that_fit.get(0.4) or cells_that_fit.get(0.35) or [np.inf])
    assert pytest.approx(0.35) == ROBOT.circumscribed_radius + TURNING_ROOM
    assert (place is None) == (away == np.inf)
    if place is not None:
        assert place.distance_to(goal) == pytest.approx(away)
        assert place.heading == 0.3
