"""The operator's own goal in a real run: paused, continued, cancelled, and refused."""

from __future__ import annotations

import pytest

import missions
from stack.telemetry.records import MissionState
from stack.types import Pose2D

DRIVE = """
run:
  navigate_to_pose: {goal: [5.0, 3.8, 0]}
"""


@pytest.fixture
def run(tmp_path, live_run):
    """The robot is on its way to a goal of the operator."""
    made = live_run(tmp_path / "m", DRIVE)
    made.steps(40)
    assert made.order("set_goal", x=1.0, y=3.5, heading=2.0).done
    made.steps(30)
    assert made.snapshot.detour and made.speed > 0.1
    return made


def test_a_pause_keeps_the_goal_and_resume_drives_on(run):
    assert run.order("pause").done
    assert run.order("pause").done  # the second changes nothing
    run.steps(60)
    assert run.speed < 0.02
    assert run.snapshot.detour_held and not run.snapshot.detour
    assert run.order("resume").done
    assert run.runtime.state is MissionState.PAUSED and run.snapshot.detour
    run.until("task")
    assert run.runtime.parts.scorer.truth.distance_to(Pose2D(1.0, 3.5)) < 0.15
    assert run.order("resume").done
    assert run.runtime.state is MissionState.RUNNING


@pytest.mark.parametrize("held", [False, True])
def test_a_cancelled_goal_leaves_the_mission_paused(run, held):
    if held:
        run.order("pause")
    assert run.order("cancel_goal").done
    assert not run.snapshot.detour and not run.snapshot.detour_held
    run.steps(60)
    assert run.speed < 0.02 and run.runtime.state is MissionState.PAUSED
    assert "not on the way" in run.order("cancel_goal").reason
    assert run.order("resume").done
    run.until("mission_ended", within=800)
    assert run.runtime.state is MissionState.SUCCESS


def test_a_new_goal_replaces_one_that_is_paused(run):
    run.order("pause")
    assert run.order("set_goal", x=1.5, y=3.0, heading=0.0).done
    run.steps(30)
    assert run.snapshot.detour and not run.snapshot.detour_held and run.speed > 0.1


def test_a_debugger_s_step_continues_the_mission(run):
    run.order("pause")
    assert run.order("step").done
    assert run.runtime.state is MissionState.RUNNING and not run.snapshot.detour_held


def test_a_robot_of_recorded_sensors_is_not_sent_anywhere(tmp_path, live_run):
    file = tmp_path / "m.yaml"
    file.write_text("mission: m\nrobot: scout\nworld: small_room\nrun: {wait: 2 s}\n")
    missions.run(file, out=tmp_path / "run", record=("sensors",), seed=1)
    run = live_run(tmp_path / "r", DRIVE, replay=tmp_path / "run" / "sensors.mcap")
    run.steps(4)
    for kind, arguments in (("set_goal", {"x": 1.0, "y": 3.5, "heading": 2.0}), ("teleop", {})):
        answer = run.order(kind, **arguments)
        assert not answer.done and "plays recorded sensors" in answer.reason
    assert run.runtime.state is MissionState.RUNNING
