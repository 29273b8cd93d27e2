"""Breakpoints, steps and forces in a run: when the robot stands, and what is refused."""

import pytest

from stack.telemetry.records import MissionState

MISSION = """
    run:
      parallel:
        - navigate_to_pose: {goal: [5.0, 3.8, 0]}
          name: drive
        - sequence:
            - wait: {time: 1 s}
            - wait: {time: 0.5 s}
              name: second
          name: waits
          timeout: 1.7 s
"""


@pytest.fixture
def run(tmp_path, live_run):
    return live_run(tmp_path, MISSION, breakpoints=("second",))


def test_the_robot_and_its_clock_stand_at_a_breakpoint(run):
    run.until("breakpoint")
    assert run.runtime.state is MissionState.PAUSED
    assert run.speed > 0.2  # it was on its way
    run.steps(40)
    assert run.speed < 0.02
    time = run.engine.body.time
    run.steps(10)
    assert run.engine.body.time == time
    run.order("continue")
    run.steps(30)
    assert run.runtime.state is MissionState.RUNNING
    assert run.runtime.reason == ""
    assert run.speed > 0.2


def test_a_step_is_one_tick_and_the_driving_until_the_next(run):
    run.until("breakpoint")
    run.steps(40)
    before, ticks = run.engine.body.time, run.engine.tree.ticks
    run.order("step", ticks=3)
    run.steps(60)
    assert run.runtime.state is MissionState.PAUSED
    assert run.engine.tree.ticks == ticks + 3
    assert run.snapshot.reason == "all ticks of the step are done; step or continue"
    assert run.engine.body.time - before >= 0.3 - 0.05


def test_time_at_a_breakpoint_does_not_count_for_the_mission(run):
    """1.5 s of waiting within 1.7 s, though coming to a stand takes more than the rest."""
    stopped = run.until("breakpoint").time
    run.steps(40)
    assert run.engine.body.time - stopped > 0.2
    run.order("continue")
    run.steps(20)
    statuses = {row.name: row.status for row in run.snapshot.tree}
    assert statuses["waits"] == "success"


def test_a_behaviours_own_time_stands_still_while_the_robot_brakes(run):
    """The first node waits 1 s; the robot needs more than 0.3 s of its clock to stop."""
    run.order("unbreak")
    run.steps(11)  # 0.55 s
    paused = run.engine.body.time
    assert run.order("pause").done
    run.steps(40)
    pause = run.engine.body.time - paused
    assert pause > 0.3
    assert run.order("resume").done
    ended = run.until("node_status")
    assert ended.text == "wait: running > success"
    assert 1.0 - 1e-6 < ended.time - pause < 1.1  # at the first tick, one each 0.1 s


def test_a_running_mission_pauses_after_the_steps(run):
    run.order("unbreak")
    assert run.order("step", ticks=2).done
    run.steps(40)
    assert run.runtime.state is MissionState.PAUSED
    assert run.order("resume").done
    run.steps(40)
    assert run.runtime.state is MissionState.RUNNING


@pytest.mark.parametrize(
    ("kind", "arguments", "reason"),
    [
        ("break", {}, "break: needs the argument 'node': number, name"),
        ("break", {"node": "secnd"}, "no node is called 'secnd'; did you mean 'second'?"),
        ("break", {"node": "1", "generation": 1}, "the tree was replaced; choose"),
        ("unbreak", {"node": "drive"}, "there is no breakpoint at 'drive'"),
        ("step", {"ticks": 0}, "step: ticks: 0 must be at least 1"),
        ("step", {"ticks": "two"}, "ticks: expected a whole number, got 'two'"),
        ("step", {"ticks": True}, "got true"),
        ("continue", {}, "cannot resume: the mission is running"),
        (
            "force",
            {"node": "drive", "status": "maybe"},
            "'maybe' is not one of success, failure, off, due",
        ),
        ("bark", {}, "no command 'bark'; available: pause"),
    ],
)
def test_orders_that_make_no_sense_are_refused_with_the_reason(run, kind, arguments, reason):
    run.steps(4)
    ack = run.order(kind, **arguments)
    assert not ack.done
    assert reason in ack.reason


def test_an_emergency_stop_comes_before_stepping(run):
    run.until("breakpoint")
    run.order("estop")
    assert "emergency stop" in run.order("step").reason
    run.order("release")
    assert run.runtime.state is MissionState.PAUSED


def test_forcing_what_drives_stops_the_robot(run):
    run.steps(40)
    run.order("force", node="drive", status="success")
    run.order("continue")
    run.steps(10)
    assert run.speed < 0.05
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS
