"""Paths of the Panda: free, repeatable, and refused with names."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from stack.errors import NavigationError
from stack.geometry.rotations import from_angles
from stack.manipulation.collisions import Collisions
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.rrt_connect import Space, rrt_connect
from stack.manipulation.scene import Box, Scene, SceneObject
from stack.types import FailureCode
from tests.benchmarks.arm_planning import problem, run
from tests.stack.manipulation.panda import HOME, LIMITS, panda, posed

PLANNER = ArmPlanner(panda())


def body(name, size, x, y, z):
    return SceneObject(name, Box(size), from_angles((x, y, z), (0, 0, 0)))


TABLE = body("table", (1.0, 1.6, 0.04), 0.65, 0.0, -0.03)
WALL = body("wall", (0.5, 0.02, 0.5), 0.5, 0.0, 0.25)
RIGHT, LEFT = posed(-0.6, 0.6, 0, -0.3, 0, 0, 0), posed(0.6, 0.6, 0, -0.3, 0, 0, 0)


def generator(seed=0):
    return np.random.default_rng(seed)


def test_a_path_around_a_wall_is_free():
    scene = Scene((TABLE, WALL))
    assert not Collisions(panda(), scene).is_free(RIGHT, LEFT)
    path = PLANNER.plan(RIGHT, [LEFT], scene, generator())
    assert path[0] == pytest.approx(RIGHT) and path[-1] == pytest.approx(LEFT)
    touching = Collisions(panda(), scene, 0.0)
    for first, second in pairwise(path):  # half of the 10 mm remain between the checks
        for share in np.linspace(0.0, 1.0, 50):
            assert touching.distance(first + share * (second - first)) > 0.005


def test_the_same_seed_gives_the_same_path_whatever_was_planned_before():
    scene = Scene((TABLE, WALL))
    first = PLANNER.plan(RIGHT, [LEFT], scene, generator(1))
    other = PLANNER.plan(RIGHT, [LEFT], scene, generator(2))
    again = ArmPlanner(panda()).plan(RIGHT, [LEFT], scene, generator(1))
    assert np.array_equal(first, again)
    assert first.shape != other.shape or not np.allclose(first, other)


def test_a_goal_that_touches_is_left_for_another():
    scene = Scene((TABLE, WALL))
    inside = posed(0, 0.6, 0, -0.3, 0, 0, 0)
    path = PLANNER.plan(RIGHT, [inside, LEFT], scene, generator())
    assert path[-1] == pytest.approx(LEFT)


@pytest.mark.parametrize(
    ("start", "goal", "code", "words"),
    [
        (posed(0, 0.6, 0, -0.3, 0, 0, 0), LEFT, FailureCode.START_OCCUPIED, "wall"),
        (LEFT, posed(0, 0.6, 0, -0.3, 0, 0, 0), FailureCode.GOAL_OCCUPIED, "wall"),
        (LEFT, posed(3.0, 0, 0, 0, 0, 0, 0), FailureCode.UNREACHABLE, "panda_joint1 would be"),
    ],
)
def test_refusals_name_what_is_wrong(start, goal, code, words):
    with pytest.raises(NavigationError, match=words) as caught:
        PLANNER.plan(start, [goal], Scene((TABLE, WALL)), generator())
    assert caught.value.failure.code == code


def test_nothing_found_says_how_long_it_was_searched():
    walls = Scene((TABLE, WALL))
    with pytest.raises(NavigationError, match="with 1 samples") as caught:
        PLANNER.plan(RIGHT, [LEFT], walls, generator(), iterations=1)
    assert caught.value.failure.code == FailureCode.NO_MOTION_PLAN


def test_a_start_close_to_an_object_is_left_with_less_clearance():
    """The finger tips are 7.2 mm below the tool: 3 mm above this table, less than the 10 mm."""
    height = PLANNER.kinematics.forward(HOME)[2, 3] - 0.0072 - 0.003
    table = body("table", (0.4, 0.4, 0.1), 0.3, 0.0, height - 0.05)
    path = PLANNER.plan(HOME, [posed(0, -0.4, 0, 0, 0, 0, 0)], Scene((table,)), generator())
    touching = Collisions(panda(), Scene((table,)))
    assert all(touching.distance(positions) > 0.0 for positions in path)


def test_to_a_pose():
    target = PLANNER.kinematics.forward(LEFT)
    path = PLANNER.plan_to_pose(RIGHT, target, Scene((TABLE, WALL)), generator())
    assert PLANNER.kinematics.forward(path[-1]) == pytest.approx(target, abs=1e-4)
    target[0, 3] = 2.0
    with pytest.raises(NavigationError, match=r"cannot reach \(2\.000, "):
        PLANNER.plan_to_pose(RIGHT, target, Scene(), generator())


def test_the_tool_moves_along_a_line():
    begin = PLANNER.kinematics.forward(HOME)
    target = begin.copy()
    target[:3, 3] += [0.1, 0.05, -0.15]
    line = PLANNER.straight(HOME, target, Scene((TABLE,)))
    direction = (target - begin)[:3, 3] / np.linalg.norm((target - begin)[:3, 3])
    for first, second in pairwise(line):
        for share in (0.5, 1.0):  # between the waypoints too
            pose = PLANNER.kinematics.forward(first + share * (second - first))
            offset = pose[:3, 3] - begin[:3, 3]
            assert np.linalg.norm(offset - (offset @ direction) * direction) < 5e-4
            assert pose[:3, :3] == pytest.approx(begin[:3, :3], abs=2e-3)
    assert PLANNER.kinematics.forward(line[-1]) == pytest.approx(target, abs=1e-4)


def test_a_slower_motion():
    """Half of the velocity where it is the limit: a turn of 4 rad by the first joint alone."""
    path = np.array([posed(-2, 0, 0, 0, 0, 0, 0), posed(2, 0, 0, 0, 0, 0, 0)])
    full, half = (PLANNER.trajectory(path, Scene(), speed) for speed in (1.0, 0.5))
    assert np.abs(half.velocities[:, 0]).max() == pytest.approx(2.175 / 2.0)
    assert half.duration > 1.8 * full.duration


def test_a_line_that_something_blocks_and_one_that_leaves_the_reach():
    target = PLANNER.kinematics.forward(HOME)
    target[1, 3] += 0.4
    pole = body("pole", (0.02, 0.02, 0.3), 0.307, 0.2, 0.4)
    with pytest.raises(NavigationError, match=r"blocked after \d+ % of it: panda_\w+ .* pole"):
        PLANNER.straight(HOME, target, Scene((pole,)))
    target[0, 3] += 0.8
    with pytest.raises(NavigationError, match=r"cannot follow the line .* beyond \d+ %"):
        PLANNER.straight(HOME, target, Scene())


def test_a_line_that_needs_another_posture():
    """Beyond this pose the solution that continues the line is another one, 0.35 rad away."""
    start = np.array([0.602, 0.053, 1.928, -1.113, -1.457, 3.505, -0.349])
    target = PLANNER.kinematics.forward(start)
    target[:3, 3] = [-0.333, 0.198, 0.809]
    with pytest.raises(NavigationError, match="in this posture"):
        PLANNER.straight(start, target, Scene())


def test_the_search_finds_the_gap_in_a_wall():
    """A plane with a wall at x = 0 that has a gap of 0.2 at y = 0.8."""

    def is_free(start, end):
        x, y = np.linspace(start, end, 50).T
        return not np.any((np.abs(x) < 0.05) & (np.abs(y - 0.8) > 0.1))

    space = Space(-np.ones(2), np.ones(2), is_free)
    start, goals = np.array([-0.8, 0.0]), [np.array([0.8, 0.0]), np.array([0.8, -0.5])]
    search = partial(rrt_connect, start, goals, space)
    path = search(generator(), 2000)
    assert path[0] == pytest.approx(start)
    assert any(path[-1] == pytest.approx(goal) for goal in goals)
    assert all(is_free(a, b) for a, b in pairwise(path))
    assert np.array_equal(path, search(generator(), 2000))
    assert search(generator(), 2) is None


def test_problems_of_the_benchmark_are_solved():
    (figures,) = run(4)
    assert figures["solved_%"] == 100.0
    assert figures["sound_%"] == 100.0
    assert figures["same_path_again"] == "yes"
    item = problem(panda(), 0)
    assert np.all(item.start >= LIMITS.lower) and np.all(item.start <= LIMITS.upper)
