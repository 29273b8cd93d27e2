"""The emergency stop in a real run: during a detour, at the end of a mission, and its reset."""

from __future__ import annotations

import pytest

from stack.telemetry.records import Command, MissionState
from stack.types import STANDSTILL, Pose2D

DRIVE = """
run:
  sequence:
    - navigate_to_pose: {goal: [5.0, 3.8, 0]}
      name: drive
"""
ENDS_MOVING = """
run:
  sequence:
    - wait: {time: 1 s}
    - parallel:
        succeed_on: one
        do:
          - drive_for: {linear: 0.5, time: 20 s}
          - wait: {time: 2 s}
"""


@pytest.fixture
def live(tmp_path, live_run):
    return lambda text: live_run(tmp_path / "m", text)


def test_a_release_during_a_detour_does_not_move_the_robot(live):
    """Before, the robot turned at 1.37 rad/s in the state `paused` without a `resume`."""
    run = live(DRIVE)
    run.steps(40)
    assert run.order("set_goal", x=1.0, y=3.5, heading=2.0).done
    run.steps(30)
    assert run.speed > 0.1
    assert run.snapshot.detour
    assert run.order("estop").done
    assert not run.snapshot.detour
    run.steps(60)
    assert run.speed < 0.02
    assert run.order("release").done
    assert run.runtime.state is MissionState.PAUSED
    distance = run.runtime.distance
    for _ in range(60):
        run.steps()
        assert run.runtime.command.twist == STANDSTILL
        assert run.speed < 0.02
    assert run.runtime.distance == pytest.approx(distance, abs=0.002)
    assert run.order("resume").done
    assert run.runtime.state is MissionState.RUNNING
    run.until("mission_ended", within=800)
    assert run.runtime.state is MissionState.SUCCESS


def test_a_detour_that_takes_longer_than_progress_time_does_not_fail_the_mission(live):
    run = live(DRIVE)
    run.steps(40)
    assert run.order("pause").done
    begin, here = run.engine.body.time, run.runtime.parts.scorer.truth
    for x, y in ((1.2, 2.8), (here.x, here.y)):
        assert run.order("set_goal", x=x, y=y, heading=here.heading).done
        assert run.snapshot.detour
        run.until("task")
        assert run.runtime.parts.scorer.truth.distance_to(Pose2D(x, y)) < 0.15
    assert run.engine.body.time - begin > 8.0  # progress_time
    assert run.order("resume").done
    run.until("mission_ended", within=800)
    assert run.runtime.state is MissionState.SUCCESS


def test_an_emergency_stop_is_accepted_while_the_robot_brakes_after_the_mission(live):
    run = live(ENDS_MOVING)
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS
    assert run.speed > 0.2
    assert not run.runtime.apply(Command("a", "pause", {})).done
    assert run.runtime.apply(Command("b", "estop", {"reason": "a hand"})).done
    run.runtime.step()
    assert run.runtime.command.twist == STANDSTILL
    assert run.runtime.command.reason == "emergency stop: a hand"
    assert run.runtime.state is MissionState.SUCCESS
    while not run.runtime.is_standing and run.runtime.steps < 1000:
        run.runtime.step()
    assert run.speed < 0.02
    assert run.runtime.apply(Command("c", "release", {})).done
    assert not run.runtime.apply(Command("d", "resume", {})).done
