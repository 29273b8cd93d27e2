"""Detours of the operator during a run with the simulated robot."""

import pytest

from missions.execution.build import build, run_info
from missions.execution.prepare import RunOptions, prepare
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Command, MissionState
from stack.types import STANDSTILL, Pose2D, wrap_angle

MISSION = """mission: there
format: 1
robot: scout
world: small_room
start: home
run:
  navigate_to_pose: {goal: [5.0, 1.0]}
"""
DETOUR = Pose2D(1.2, 2.8)


class Run:
    """A run whose commands take effect between two steps."""

    def __init__(self, plan):
        self.telemetry = Telemetry(run_info(plan, "there", 0), [])
        self.engine = build(plan, RunOptions(serve=False), self.telemetry, None)
        self.runtime, self._sent = self.engine.runtime, 0

    def order(self, kind, **arguments):
        self._sent += 1
        ack = self.runtime.apply(Command(f"{self._sent}", kind, arguments))
        assert ack.done, ack.reason

    def goal(self, pose):
        self.order("set_goal", x=pose.x, y=pose.y, heading=pose.heading)

    def step(self, seconds, until=lambda: False):
        for _ in range(round(seconds / self.runtime.period)):
            if until():
                return
            self.runtime.step()

    @property
    def pose(self):
        return self.runtime.parts.scorer.truth

    def stands_at(self, goal):
        state = self.runtime.perceived
        still = state.motion.twist.linear < 0.02 and self.runtime.command.twist == STANDSTILL
        turn = abs(wrap_angle(self.pose.heading - goal.heading))
        return still and turn < 0.15 and self.pose.distance_to(goal) < 0.15

    def close(self):
        self.runtime.parts.navigator.close()
        self.telemetry.close(None)
        self.engine.body.close()


@pytest.fixture
def run(tmp_path):
    path = tmp_path / "there.yaml"
    path.write_text(MISSION, "utf-8")
    made = Run(prepare(path, RunOptions(serve=False)))
    made.step(2.0)
    assert made.runtime.state is MissionState.RUNNING
    yield made
    made.close()


def test_a_detour_that_takes_longer_than_progress_time_does_not_fail_the_mission(run):
    run.order("pause")
    begin = run.runtime.parts.body.time
    for goal in (DETOUR, run.pose):  # there and back to where the mission was paused
        run.goal(goal)
        run.step(30.0, lambda goal=goal: run.stands_at(goal))
        assert run.stands_at(goal)
    assert run.runtime.parts.body.time - begin > 8.0  # progress_time
    run.order("resume")
    run.step(40.0, lambda: run.runtime.state.is_over)
    assert run.runtime.state is MissionState.SUCCESS, run.runtime.reason


def test_an_emergency_stop_during_a_detour_ends_it(run):
    run.order("pause")
    assert not run.runtime.snapshot().detour
    run.goal(DETOUR)
    run.step(1.0)
    assert run.runtime.snapshot().detour
    run.order("estop")
    assert not run.runtime.snapshot().detour
    run.step(2.0)
    where = run.pose
    run.order("release")
    run.step(3.0)
    assert run.runtime.command.twist == STANDSTILL
    assert run.pose.distance_to(where) < 0.01
    assert run.runtime.state is MissionState.PAUSED
    run.order("resume")
    run.step(40.0, lambda: run.runtime.state.is_over)
    assert run.runtime.state is MissionState.SUCCESS, run.runtime.reason
