"""The scripted robot promises to behaviours what stack.robot does, and nothing else."""

from inspect import isfunction, signature

import numpy as np
import pytest

from behaviours.testing import ScriptedRobot
from stack.robot import Base
from stack.types import Imu, TaskStatus, Twist


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda robot: robot.spin(1.0), r"robot has no 'spin'; it is robot.base.spin"),
        (lambda robot: robot.map.navigate_to(None), r"robot.map has no 'navigate_to'; it is robot"),
        (lambda robot: robot.perception.picture, r"robot.perception has no 'picture'$"),
    ],
)
def test_what_another_capability_has_is_not_there(ask, sentence):
    with pytest.raises(AttributeError, match=sentence):
        ask(ScriptedRobot().interface)


def test_a_velocity_is_one_task_until_its_time_is_over():
    robot = ScriptedRobot()
    task = robot.interface.base.drive_for(Twist(0.2), 0.3)
    robot.advance(0.2)
    assert robot.interface.base.drive_for(Twist(0.1), 0.3) is task
    robot.advance(0.2)
    assert task.status is TaskStatus.RUNNING
    robot.advance(0.1)
    assert task.status is TaskStatus.SUCCEEDED


def test_another_motion_cancels_a_velocity():
    robot = ScriptedRobot()
    task = robot.interface.base.drive_for(Twist(0.2), 0.3)
    robot.interface.base.spin(1.0)
    assert task.status is TaskStatus.CANCELLED


def test_measurements_are_asked_by_name_and_type():
    imu = Imu(np.ones(1), np.zeros((1, 3)), np.zeros((1, 3)))
    robot = ScriptedRobot(measurements={"imu": imu})
    assert robot.interface.perception.newest("imu", Imu) is imu
    assert robot.interface.perception.newest("other", Imu) is None


TASKS = [
    call for name, call in vars(Base).items()
    if isfunction(call) and signature(call).return_annotation == "Task" and name != "drive_for"
]  # fmt: skip
"""Calls that only begin a task; a velocity is `robot.twist`."""


@pytest.mark.parametrize("call", TASKS, ids=lambda call: call.__name__)
def test_a_call_that_begins_a_task_is_recorded_with_all_arguments_of_the_protocol(call):
    """Except `while_lost`, by which the scripted robot answers."""
    _, *form = signature(call).parameters.values()
    given = [item.name for item in form if item.default is item.empty]
    robot = ScriptedRobot()
    begin = getattr(robot.interface.base, call.__name__)
    task = begin(*given)
    ((called, arguments),) = robot.calls
    assert called == call.__name__ and task is robot.task
    assert list(arguments) == [item.name for item in form if item.name != "while_lost"]
    assert [arguments[name] for name in given] == given
    with pytest.raises(TypeError):
        begin(*given, other=1)
