"""Behaviours about rival poses: disambiguate, localise_globally, set_pose."""

import pytest
from py_trees.common import Status

from behaviours.localisation.disambiguate import Disambiguate
from behaviours.localisation.localise_globally import LocaliseGlobally
from behaviours.localisation.set_pose import SetPose
from behaviours.testing import ScriptedRobot, halt, tick
from stack.types import Pose2D, RivalPose, TaskStatus

RIVALS = (RivalPose(Pose2D(5.0, 0.0), 0.4), RivalPose(Pose2D(9.0, 0.0), 0.2))


def test_disambiguate_follows_its_task_and_counts_the_rivals():
    robot, behaviour = ScriptedRobot(rivals=RIVALS), Disambiguate()
    assert tick(behaviour, robot) is Status.RUNNING
    assert behaviour.rivals == 2
    robot.rivals = ()
    robot.task.succeed()
    assert tick(behaviour, robot) is Status.SUCCESS
    assert behaviour.rivals == 0
    assert robot.calls_of("disambiguate") == [{}]


def test_disambiguate_fails_with_the_reason_and_is_cancelled_when_pre_empted():
    robot, behaviour = ScriptedRobot(rivals=RIVALS), Disambiguate()
    tick(behaviour, robot)
    robot.task.fail("AMBIGUOUS", "no place differs")
    assert tick(behaviour, robot) is Status.FAILURE
    assert (behaviour.failure.code, behaviour.rivals) == ("AMBIGUOUS", 2)
    tick(behaviour, robot)
    halt(behaviour)
    assert robot.task.status is TaskStatus.CANCELLED


@pytest.mark.parametrize("unique", [True, False])
def test_rivals_are_a_failure_only_of_a_search_for_one_pose(unique):
    robot, behaviour = ScriptedRobot(rivals=RIVALS), LocaliseGlobally(unique=unique)
    assert tick(behaviour, robot) is Status.RUNNING
    robot.task.fail("AMBIGUOUS", "three places fit")
    assert tick(behaviour, robot) is (Status.FAILURE if unique else Status.SUCCESS)
    assert behaviour.rivals == 2


def test_a_search_that_finds_nothing_fails_in_any_case():
    robot, behaviour = ScriptedRobot(), LocaliseGlobally(unique=False)
    tick(behaviour, robot)
    robot.task.fail("LOST", "nothing fits")
    assert tick(behaviour, robot) is Status.FAILURE
    assert behaviour.failure.code == "LOST"


def test_set_pose_tells_the_localisation():
    robot = ScriptedRobot(rivals=RIVALS)
    assert tick(SetPose(pose=Pose2D(1.0, 2.0, 0.5)), robot) is Status.SUCCESS
    assert robot.calls_of("set_pose") == [{
        "pose": Pose2D(1.0, 2.0, 0.5), "position_deviation": 0.1, "heading_deviation": 0.05,
        "source": "mission",
    }]  # fmt: skip
