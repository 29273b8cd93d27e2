"""The behaviours that do not drive."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from py_trees.common import Status

from behaviours.flow.check import Check
from behaviours.flow.say import Say
from behaviours.flow.set import Set
from behaviours.flow.wait import Wait
from behaviours.flow.wait_until import WaitUntil
from behaviours.navigation.clear_costmap import ClearCostmap
from behaviours.navigation.clear_costmap_around_robot import ClearCostmapAroundRobot
from behaviours.navigation.set_edge import SetEdge
from behaviours.perception.take_photo import TakePhoto
from behaviours.testing import ScriptedRobot, tick
from stack.types import Assignments, CameraModel, Image

CAMERA = CameraModel(4, 3, 3.0, (0.1, 0.0, 0.2))


@dataclass
class ScriptedExpression:
    """An expression with the value that the test gives it."""

    value: object
    source: str = "battery.charge > 0.3"
    asked: list[object] = field(default_factory=list)

    def __call__(self) -> object:
        self.asked.append(self.value)
        return self.value

    def explain(self) -> str:
        return f"battery.charge ({self.value}) > 0.3"


@pytest.fixture
def robot():
    return ScriptedRobot()


def picture(stamp):
    return Image(stamp, np.zeros((3, 4, 3), dtype=np.uint8), CAMERA)


def test_waits_on_the_robots_clock(robot):
    robot.time = 100.0
    wait = Wait(time=3.0)
    assert tick(wait, robot, 2.9) is Status.RUNNING
    assert wait.feedback_message == "0.1 s left"
    robot.advance(0.1)
    assert tick(wait, robot) is Status.SUCCESS


def test_waits_thirty_ticks_for_three_seconds_whatever_the_rounding(robot):
    wait = Wait(time=3.0)
    ticks = 0
    robot.time = 0.0
    while tick(wait, robot) is Status.RUNNING:
        robot.time += 0.1  # thirty times 0.1 summed is 2.9999999999999996
        ticks += 1
    assert ticks == 30


def test_waiting_for_nothing_succeeds_at_once(robot):
    assert tick(Wait(time=0.0), robot) is Status.SUCCESS


def test_waits_until_a_condition_holds(robot):
    condition = ScriptedExpression(False)
    wait = WaitUntil(condition=condition)
    assert tick(wait, robot, 1.0) is Status.RUNNING
    assert wait.feedback_message == "waiting for battery.charge (False) > 0.3"
    condition.value = True
    assert tick(wait, robot) is Status.SUCCESS
    assert len(condition.asked) == 12  # 11 ticks in the first second, and one more


def test_check_answers_at_once(robot):
    assert tick(Check(condition=ScriptedExpression(True)), robot) is Status.SUCCESS
    check = Check(condition=ScriptedExpression(False))
    assert tick(check, robot) is Status.FAILURE
    assert check.failure.code == "CHECK_FAILED"
    assert check.failure.sentence == "not true: battery.charge (False) > 0.3"


def test_sets_all_keys_from_the_values_before(robot):
    board = {"a": 1, "b": 2}

    def key(name, source):
        value = ScriptedExpression(board[source])
        return name, value, lambda written: board.__setitem__(name, written)

    swap = Set(assignments=Assignments((key("a", "b"), key("b", "a"))))
    assert tick(swap, robot) is Status.SUCCESS
    assert board == {"a": 2, "b": 1}
    assert swap.feedback_message == "a = 2, b = 1"


def test_say_writes_one_message(robot):
    assert tick(Say(text="shelf done"), robot) is Status.SUCCESS
    assert robot.said == ["shelf done"]


def test_clears_the_selected_costmap(robot):
    assert tick(ClearCostmap(which="local"), robot) is Status.SUCCESS
    assert robot.calls_of("clear_costmap") == [{"which": "local"}]


def test_clears_around_the_robot_in_one_layer_or_all(robot):
    assert tick(ClearCostmapAroundRobot(radius=1.5, layer="obstacle"), robot) is Status.SUCCESS
    assert tick(ClearCostmapAroundRobot(radius=2.0, which="local"), robot) is Status.SUCCESS
    assert robot.calls_of("clear_costmap") == [
        {"which": "both", "radius": 1.5, "layer": "obstacle"},
        {"which": "local", "radius": 2.0},
    ]


def test_keeps_a_picture_newer_than_the_start(robot):
    robot.time, robot.picture = 10.0, picture(9.9)
    photo = TakePhoto(label="shelf a/../x")
    assert tick(photo, robot, 0.3) is Status.RUNNING
    robot.picture = picture(10.2)
    assert tick(photo, robot) is Status.SUCCESS
    assert photo.image == "images/shelf_a_x_0010.20s.png"
    assert robot.calls_of("save_image")[0]["image"].stamp == 10.2


@pytest.mark.parametrize("old", [None, picture(9.9)])
def test_no_picture_within_the_patience_is_a_failure(robot, old):
    robot.time, robot.picture = 10.0, old
    photo = TakePhoto(patience=0.5)
    assert tick(photo, robot, 0.4) is Status.RUNNING
    assert tick(photo, robot, 0.1) is Status.FAILURE
    assert photo.failure.code == "NO_IMAGE"
    assert photo.failure.sentence == "the camera gave no new picture within 0.5 s"
    assert robot.calls_of("save_image") == []


def test_an_edge_is_closed_and_opened(robot):
    robot.edges = ("middle",)
    assert tick(SetEdge(edge="middle"), robot) is Status.SUCCESS
    assert tick(SetEdge(edge="middle", closed=False), robot) is Status.SUCCESS
    assert robot.calls_of("set_edge") == [
        {"edge": "middle", "closed": True}, {"edge": "middle", "closed": False},
    ]  # fmt: skip


def test_an_unknown_edge_is_a_failure(robot):
    behaviour = SetEdge(edge="midle")
    assert tick(behaviour, robot) is Status.FAILURE
    assert behaviour.feedback_message == "the route graph has no edge 'midle'"
