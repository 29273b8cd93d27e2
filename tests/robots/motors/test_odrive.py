"""The driver `odrive_can` in a fast loop, with emulated axes in a process of their own."""

from signal import SIGKILL, SIGSTOP

import numpy as np
import pytest

from robots.motors.odrive import CLEAR, OdriveParameters
from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.drivetrain.wheel_loop import LINEAR, MEASURED_SPEEDS, block, loop_plan
from stack.errors import BodyError, ParameterError
from stack.fast_loop.client import FastLoop, LoopSetup
from stack.types import Twist
from tests.robots.motors.axes_process import axes_process
from tests.robots.motors.signals import SCOUT, stop_after
from tests.stack.fast_loop.test_process import state_of, until

pytestmark = pytest.mark.xdist_group("fast_loop")

DRIVE = Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(Limits(linear_acceleration=1.5))


@pytest.fixture
def axes():
    with axes_process() as process:
        yield process


@pytest.fixture
def start(axes):
    loops = []

    def make(**parameters):
        plan = loop_plan(DRIVE, 0.3, 2.0)
        setup = LoopSetup(plan, "odrive_can", {**axes.driver, **parameters}, 250.0)
        loops.append(FastLoop(setup))
        return loops[-1]

    yield make
    for loop in loops:
        loop.close()


def test_wheels_turn_as_they_are_told_and_are_idle_at_the_end(axes, start):
    loop = start(turns=[-4.0, 2.0])
    speeds = pytest.approx([5.0, 5.0], abs=0.2)  # 0.5 m/s at a radius of 0.1 m
    until(
        lambda: (state := state_of(loop)) is not None and block(state, MEASURED_SPEEDS) == speeds,
        lambda: loop.command(Twist(0.5)),
    )
    assert loop.fault == ""
    _, ((_, left), (_, right)) = axes.order()
    assert (left, right) == pytest.approx((-4 * 5 / (2 * np.pi), 2 * 5 / (2 * np.pi)), rel=0.05)
    until(lambda: state_of(loop)[LINEAR] == 0.0, lambda: loop.command(Twist()))
    loop.close()
    axes.order(is_calibrated=False)
    with pytest.raises(BodyError, match="node 0 does not enter closed loop control: IDLE, NOT_CAL"):
        start()


def test_an_error_stops_the_robot_until_it_is_cleared(axes, start):
    loop = start()
    until(lambda: (s := state_of(loop)) is not None and s[LINEAR] == 0.5,
          lambda: loop.command(Twist(0.5)))  # fmt: skip
    axes.order(node=1, error=0x20)
    until(lambda: loop.fault, lambda: loop.command(Twist(0.5)))
    assert loop.fault == "node 1: DRV_FAULT"
    until(lambda: axes.order()[1] == [(pytest.approx(0, abs=9), 0.0)] * 2,
          lambda: loop.command(Twist(0.5)))  # fmt: skip
    loop.send(CLEAR)
    until(lambda: state_of(loop)[LINEAR] == 0.5, lambda: loop.command(Twist(0.5)))
    assert loop.fault == ""


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"is_silent": True}, "no heartbeat of node 1 on udp_multicast"),
        ({"watchdog": 0.0}, "node 1 has no watchdog: the robot would drive on"),
        ({"standing_error": 16, "error": 16}, "the errors of node 1 stand: BAD_CONFIG"),
    ],
)
def test_what_cannot_drive_is_refused_before_anything_moves(axes, start, change, sentence):
    axes.order(node=1, **change)
    with pytest.raises(BodyError, match=sentence):
        start()


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"nodes": (1, 1)}, "each axis has its own"),
        ({"turns": (1.0, 0.0)}, "expected 2 numbers other than 0"),
        ({"watchdog": 0.05, "setpoints": 20.0}, "less than two periods of setpoints"),
        ({"interface": "udp_multicast", "channel": "239.0.0.1"}, "expected ADDRESS:PORT"),
    ],
)
def test_wrong_parameters(values, sentence):
    with pytest.raises(ParameterError, match=sentence):
        OdriveParameters(**values)


@pytest.mark.parametrize(
    ("victim", "number"),
    [("brain", SIGKILL), ("brain", SIGSTOP), ("loop", SIGKILL), ("loop", SIGSTOP)],
)
def test_the_wheels_stand_when_the_brain_or_the_loop_is_gone(victim, number):
    """The times are those of test_faults.py, and are measured by signals.py."""
    assert stop_after(victim, number, SCOUT).distance > 0.0
