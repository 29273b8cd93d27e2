"""Exploration and coverage with a scripted robot: choices, forgetting, ends."""

import numpy as np
import pytest
from py_trees.common import Status

from behaviours.mapping.explore import LOOK_ANGLE, Explore
from behaviours.mapping.load_map import LoadMap
from behaviours.mapping.save_map import SaveMap
from behaviours.navigation.coverage import Coverage
from behaviours.testing import ScriptedRobot, halt, tick
from stack.errors import NavigationError
from stack.types import CoveragePlan, FailureCode, Frontier, Pose2D, TaskStatus


def frontier(x, gain=5.0, distance=1.0):
    return Frontier(Pose2D(x, 0.0), (x + 0.5, 0.0), 1.0, gain, distance)


NEAR, FAR, WIDE = frontier(2.0, 4.0, 2.0), frontier(9.0, 4.0, 9.0), frontier(5.0, 20.0, 5.0)


def goals(robot):
    return [call["goal"].x for call in robot.calls_of("navigate_to")]


def test_near_frontiers_with_much_to_see_are_next_and_home_is_last():
    """Fourth root of the gain by distance + detour: 1.41 / 4 = 0.35, 2.11 / 7 = 0.30, 1.41 / 11."""
    robot = ScriptedRobot(frontier_list=[NEAR, WIDE, FAR], known_area=12.0)
    explore = Explore()
    assert tick(explore, robot) is Status.RUNNING
    assert goals(robot) == [2.0]
    robot.frontier_list = []
    robot.task.succeed()
    assert tick(explore, robot, 1.5) is Status.RUNNING
    assert goals(robot) == [2.0, 0.0]
    robot.task.succeed()
    assert tick(explore, robot, 0.5) is Status.SUCCESS
    assert (explore.known_area, explore.unreachable) == (12.0, 0)


def test_a_frontier_that_appears_on_the_way_home_is_visited():
    robot = ScriptedRobot()
    explore = Explore()
    tick(explore, robot, 1.5)
    assert goals(robot) == [0.0]
    robot.frontier_list = [NEAR]
    tick(explore, robot, 1.5)
    assert goals(robot) == [0.0, 2.0]
    robot.frontier_list = []
    robot.task.succeed()
    tick(explore, robot, 1.5)
    assert goals(robot) == [0.0, 2.0, 0.0]


def test_a_drive_ends_when_its_frontier_has_been_seen_from_the_way():
    robot = ScriptedRobot(frontier_list=[WIDE, NEAR])
    explore = Explore()
    tick(explore, robot, 0.5)
    drive = robot.task
    robot.frontier_list = [WIDE]
    tick(explore, robot, 1.5)
    assert goals(robot) == [2.0, 5.0]
    assert drive.status is not TaskStatus.SUCCEEDED


def test_of_a_place_that_cannot_be_reached_three_views_are_tried():
    robot = ScriptedRobot(frontier_list=[NEAR])
    explore = Explore(return_home=False)
    for _ in range(3):
        tick(explore, robot, 0.3)
        robot.task.fail(FailureCode.NO_VALID_PATH, "a wall")
    assert tick(explore, robot, 3.0) is Status.SUCCESS
    assert goals(robot) == [2.0, 2.0, 2.0]
    assert (explore.unreachable, explore.failure) == (1, None)


def test_at_a_view_the_robot_turns_a_little_before_it_gives_up():
    """SLAM adds a scan only after a motion: what the robot sees from the view is not drawn yet."""
    robot = ScriptedRobot(frontier_list=[NEAR])
    explore = Explore(return_home=False)
    tick(explore, robot, 0.3)
    robot.task.succeed()
    tick(explore, robot, 0.3)
    assert [call["angle"] for call in robot.calls_of("spin")] == [LOOK_ANGLE]
    robot.task.succeed()
    robot.frontier_list = []
    assert tick(explore, robot, 3.0) is Status.SUCCESS
    assert explore.unreachable == 0


def test_exploration_fails_when_the_way_home_is_blocked_and_stops_when_halted():
    robot = ScriptedRobot()
    explore = Explore()
    assert tick(explore, robot, 1.5) is Status.RUNNING
    robot.task.fail(FailureCode.NO_VALID_PATH, "the door is closed")
    assert tick(explore, robot, 0.5) is Status.FAILURE
    assert explore.failure.code == FailureCode.NO_VALID_PATH
    other = Explore()
    robot.frontier_list = [NEAR]
    tick(other, robot)
    halt(other)
    assert robot.task.status is TaskStatus.CANCELLED


LANES = CoveragePlan(
    ((Pose2D(0.0, 0.0), Pose2D(1.0, 0.0)), (Pose2D(1.0, 0.3, 3.14), Pose2D(0.0, 0.3, 3.14))),
    np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.3], [5.0, 5.0]]), 0.1,
)  # fmt: skip


def test_coverage_drives_lane_by_lane_and_counts_what_it_has_covered():
    robot = ScriptedRobot(lanes=LANES)
    cover = Coverage(least=0.7)
    for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 0.3), (0.0, 0.3)):
        assert tick(cover, robot) is Status.RUNNING
        robot.pose = Pose2D(x, y)
        robot.task.succeed()
    assert tick(cover, robot, 0.5) is Status.SUCCESS
    assert cover.covered == 0.75  # three of four points
    assert [name for name, _ in robot.calls][1:] == ["navigate_to", "follow_path"] * 2
    assert robot.calls_of("coverage")[0]["spacing"] == pytest.approx(2 * 0.22 * 0.8)


def test_a_blocked_lane_is_driven_around_once_and_too_little_is_a_failure():
    robot = ScriptedRobot(lanes=LANES)
    cover = Coverage(least=0.9)
    tick(cover, robot)
    robot.task.succeed()
    tick(cover, robot)
    robot.task.fail(FailureCode.COLLISION_AHEAD, "a chair")
    tick(cover, robot)
    assert [name for name, _ in robot.calls][-1] == "navigate_to"
    while cover.status is Status.RUNNING:
        robot.task.fail(FailureCode.NO_VALID_PATH, "no way")
        tick(cover, robot)
    assert cover.status is Status.FAILURE
    assert cover.failure.code == FailureCode.CHECK_FAILED


def test_no_lane_is_a_failure():
    cover = Coverage()
    assert tick(cover, ScriptedRobot()) is Status.FAILURE
    assert cover.failure.code == FailureCode.NO_VALID_PATH


def test_maps_are_saved_and_loaded_and_failures_keep_their_codes():
    robot = ScriptedRobot()
    save = SaveMap(path="flat")
    assert tick(save, robot) is Status.SUCCESS
    assert save.saved == "flat"
    assert tick(LoadMap(path="flat", pose=Pose2D(1, 2)), robot) is Status.SUCCESS
    assert robot.calls_of("load") == [{"name": "flat", "pose": Pose2D(1, 2)}]

    class Full(ScriptedRobot):
        def save(self, name):
            raise NavigationError(FailureCode.FAILED, "no space left")

    broken = SaveMap()
    assert tick(broken, Full()) is Status.FAILURE
    assert broken.failure.sentence == "no space left"
