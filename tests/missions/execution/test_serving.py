"""Operators are served while the loop waits: for a plan, a picture, or the pace."""

from __future__ import annotations

from functools import partial
from threading import Event

import pytest

from robots.simulated import SimulatedBody
from stack.components import Planner
from stack.telemetry.records import Command, MissionState
from stack.types import STANDSTILL
from tests.missions.execution.live_run import LiveRun

DRIVE = """
run: {navigate_to_pose: {goal: [5.0, 3.8, 0]}}
"""
PHOTO = """
run:
  parallel:
    do:
      - take_photo: {label: room}
      - drive_on_heading: {distance: 1 m, speed: 0.2}
"""
COMMANDED = "commanded"


class Told(SimulatedBody):
    """A simulated robot that keeps the velocities it is told."""

    def command(self, command):
        self.__dict__.setdefault(COMMANDED, []).append(command.twist)
        super().command(command)


def told(setup):
    body = Told(setup.robot, setup.world, start=setup.start, seed=setup.seed)
    body.pace = setup.pace
    return body


@pytest.fixture
def live(tmp_path, live_run):
    return partial(live_run, tmp_path / "m", make_body=told, watch=False)


def wait_and_stop(run: LiveRun) -> None:
    """Stop the robot while its next step cannot be made yet, and check that it is told so."""
    runtime, commanded = run.runtime, vars(run.engine.body)[COMMANDED]
    assert not runtime.is_ready()
    steps, time = runtime.steps, run.engine.body.time
    commanded.clear()
    run.kept.orders.append(Command("s", "estop"))
    runtime.serve()
    assert commanded == [STANDSTILL]
    assert runtime.state is MissionState.EMERGENCY_STOP
    assert run.kept.acks[-1].done
    event = run.kept.events[-1]
    assert (event.kind, event.step, event.time, event.fields["held"]) == (
        "command", steps, time, False,
    )  # fmt: skip
    assert (runtime.steps, run.engine.body.time) == (steps, time)


class Slow(Planner):
    """Plans as another planner does, once it may."""

    def __init__(self, planner):
        self._planner, self.may_end = planner, Event()

    def plan(self, costs, start, goal, *, options):
        self.may_end.wait()
        return self._planner.plan(costs, start, goal, options=options)


def test_an_emergency_stop_does_not_wait_for_a_plan(live):
    """It took effect with the plan, 329 ms later with hybrid A* in an office."""
    run = live(DRIVE)
    navigator = run.runtime.parts.navigator
    navigator.tools.planner_worker.planner = slow = Slow(navigator.tools.planner_worker.planner)
    run.steps(2)
    wait_and_stop(run)
    assert run.runtime.is_ready()  # a robot that is held needs no plan
    run.steps(1)
    slow.may_end.set()


def test_waiting_for_a_plan_changes_nothing_in_the_run(live):
    def hashed(waits: bool) -> str:
        run = live(DRIVE)
        while run.runtime.steps < 40:
            if waits and not run.runtime.is_ready():
                run.runtime.serve()
            else:
                run.steps()
        return run.telemetry.log_sha256

    assert hashed(waits=True) == hashed(waits=False)


def test_an_emergency_stop_does_not_wait_for_slow_motion(live):
    """At a thousandth of real time a step takes 50 s."""
    run = live(DRIVE, speed=0.001)
    run.steps(1)
    wait_and_stop(run)
    assert not run.runtime.is_ready()  # the pace is kept
    run.kept.orders.append(Command("f", "speed", {"factor": 0.0}))
    run.runtime.serve()
    assert run.runtime.is_ready()


def test_an_emergency_stop_does_not_wait_for_a_picture(live, monkeypatch):
    run = live(PHOTO)
    camera = run.engine.body._robot.cameras["camera"]
    while not camera._exposures:
        run.steps()
    monkeypatch.setattr(camera._renderer, "has_answered", lambda longest: False)
    while run.engine.body.rest(0.0):
        run.steps()
    wait_and_stop(run)


def test_a_plan_is_used_in_the_next_step_at_the_earliest(live):
    run = live(DRIVE, parameters={"navigator.planning_latency": "0"})
    navigator = run.runtime.parts.navigator
    navigator.tools.planner_worker.planner = slow = Slow(navigator.tools.planner_worker.planner)
    run.steps(1)  # requests a plan, and does not wait for it
    assert not run.runtime.is_ready()
    slow.may_end.set()
    run.steps(20)
    assert run.speed > 0.1
