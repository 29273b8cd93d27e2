"""Detours of a real run: drives and behaviours that an operator asks for while it is paused."""

from __future__ import annotations

import pytest

from stack.telemetry.records import MissionState
from tests.missions.execution.live_run import HEAD

MISSION = """
places: {desk: [2.0, 1.0, 0]}
run:
  sequence:
    - navigate_to_pose: {goal: [5.0, 3.8, 0]}
"""


@pytest.fixture
def run(tmp_path, live_run):
    made = live_run(tmp_path / "m", MISSION)
    made.steps(4)
    return made


def ends(run):
    """What the events say of the detours that have ended: tag, status and code."""
    return [
        (event.fields["tag"], event.fields["status"], event.fields["code"])
        for event in run.kept.events
        if event.kind == "detour"
    ]


def test_a_behaviour_takes_its_time_while_the_mission_is_paused(run):
    assert run.order("behaviour", name="wait", ports=["time=2 s"], tag="a").done
    began = run.snapshot
    assert (began.state, began.detour) == (MissionState.PAUSED, True)
    ended = run.until("detour")
    assert 1.9 <= ended.time - began.time <= 2.2  # 2 s, in ticks of 0.1 s; the clock goes on
    assert ends(run) == [("a", "success", "")]
    assert not run.snapshot.detour


def test_a_behaviour_drives_and_the_mission_continues_its_own_motion(run):
    heading = run.snapshot.pose.heading
    assert run.order("behaviour", name="spin", ports=["angle=90 deg"], tag="turn").done
    run.until("detour")
    assert ends(run) == [("turn", "success", "")]
    assert run.snapshot.pose.heading - heading == pytest.approx(1.571, abs=0.15)
    assert run.order("resume").done
    run.steps(40)
    assert run.runtime.state is MissionState.RUNNING
    assert run.speed > 0.1


@pytest.mark.parametrize(
    ("name", "ports"),
    [("spin", ["angle=180 deg"]), ("wall_follow", ["side=right"])],  # stops at its end
)
def test_resume_in_the_middle_of_a_behaviour_leaves_the_motion_of_the_mission(run, name, ports):
    assert run.order("behaviour", name=name, ports=ports, tag="turn").done
    run.steps(10)
    assert run.speed > 0.05
    assert run.order("resume").done
    assert ends(run) == [("turn", "cancelled", "CANCELLED")]
    run.steps(60)
    assert run.runtime.state is MissionState.RUNNING
    assert run.speed > 0.1


def test_pause_holds_a_behaviour_and_resume_continues_it(run):
    assert run.order("behaviour", name="spin", ports=["angle=180 deg"], tag="turn").done
    run.steps(10)
    assert run.order("pause").done
    run.steps(40)
    assert run.speed < 0.05
    assert ends(run) == []
    assert run.order("resume").done
    run.until("detour")
    assert ends(run) == [("turn", "success", "")]


@pytest.mark.parametrize("command", ["cancel_goal", "estop", "abort"])
def test_what_stops_the_robot_ends_a_detour(run, command):
    assert run.order("behaviour", name="spin", ports=["angle=180 deg"], tag="turn").done
    run.steps(10)
    assert run.order(command).done
    assert ends(run) == [("turn", "cancelled", "CANCELLED")]


def test_a_new_goal_replaces_a_behaviour_and_arrives_at_a_place(run):
    assert run.order("behaviour", name="wait", ports=["time=100 s"], tag="a").done
    ports = ["goal=desk"]
    assert run.order("behaviour", name="navigate_to_pose", ports=ports, tag="b").done
    run.until("detour")
    assert ends(run) == [("a", "cancelled", "CANCELLED"), ("b", "success", "")]
    pose = run.snapshot.pose
    assert (pose.x, pose.y) == pytest.approx((2.0, 1.0), abs=0.25)


def test_a_drive_that_cannot_arrive_says_so(run):
    assert run.order("set_goal", x=0.02, y=0.02, heading=0.0, tag="wall").done
    run.until("detour")
    [(tag, status, code)] = ends(run)
    assert (tag, status) == ("wall", "failure")
    assert code in {"GOAL_OCCUPIED", "NO_VALID_PATH"}


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"name": "spni"}, "did you mean 'spin'"),
        ({"name": "sequence"}, "there is no behaviour 'sequence'"),
        ({"name": "spin", "ports": ["angel=1"]}, "did you mean 'angle'"),
        ({"name": "spin", "ports": ["angle=soon"]}, "expected an angle, got 'soon'"),
        ({"name": "spin", "ports": ["angle"]}, "list of texts NAME=VALUE"),
        ({"name": "spin", "ports": ["angle=[1"]}, "command line"),
        ({"name": "wait"}, "wait needs this port"),
        ({"name": "navigate_to_pose", "ports": ["goal=dsek"]}, "did you mean 'desk'"),
        ({"name": "check", "ports": ["condition=1 < 2"]}, "only a mission"),
    ],
)
def test_what_cannot_be_run_is_refused_and_the_mission_goes_on(run, arguments, reason):
    answer = run.order("behaviour", **arguments)
    assert not answer.done
    assert reason in answer.reason
    assert run.runtime.state is MissionState.RUNNING


def test_what_the_robot_lacks_is_refused(tmp_path, live_run):
    run = live_run(tmp_path / "m", MISSION, HEAD.replace("scout", "scout_depth"))
    run.steps(4)
    answer = run.order("behaviour", name="take_photo")
    assert not answer.done
    assert "needs: camera; scout_depth has none" in answer.reason
