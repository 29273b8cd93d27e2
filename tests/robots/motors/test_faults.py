"""What the driver `odrive_can` does about faults, measured on a virtual clock."""

from math import inf, log, pi, tau

import pytest

from robots.motors.can_simple import AxisState, EncoderEstimates, encode, identifier
from robots.motors.odrive import CLEAR, SUPPLY
from stack.drivetrain.wheel_loop import DRIVING, LEVEL, LINEAR, OFF
from tests.robots.motors.virtual import FAULTS, RADIUS, RATE, SCOUT, SPEED, STIFF, World, stop_after

BRAKES = SPEED / SCOUT
"""Seconds in which the loop stops the robot."""
COASTS = log(1.0 + 0.05 * SPEED / (tau * RADIUS) / 0.15)
"""Seconds in which a released wheel stops: J/d ln(1 + d v / c), with J = d = 0.05, c = 0.15."""
LAG = 0.045
"""Seconds: two cycles 0.008, a setpoint 0.01, and the drive's control, whose time constant is
J / gain = 0.01: it ends a ramp of 2.4 turns/s² with 0.024 turns/s, 12 times what counts as
standing, so 0.01 ln(12) = 0.025.
"""

EXPECTED = {  # when the loop notices it, when the wheels stand, what is said
    "motor error on one axis": (0.1, 0.1 + BRAKES, "node 1: DRV_FAULT"),
    "cable of one axis off": (0.3, 0.3 + BRAKES, "node 1: no heartbeat for more than 0.3 s"),
    "CAN cable off": (0.3, 0.2 + COASTS, "node 0: no heartbeat for more than 0.3 s"),
    "controller bus-off": (0.0, 0.2 + COASTS, "the CAN controller is bus-off"),
    "supply below `least_voltage`": (1.0, 1.0 + BRAKES, "the supply has 20.0 V, less than 21 V"),
    "supply below the drive's own limit": (0.1, COASTS, "node 0: DC_BUS_UNDER_VOLTAGE"),
    "brain frozen": (0.15, 0.15 + BRAKES, ""),
    "fast loop frozen or killed": (inf, 0.2 + COASTS, ""),
}


@pytest.fixture
def make():
    worlds = []

    def world(*arguments, **parameters):
        worlds.append(World(*arguments, **parameters))
        return worlds[-1]

    yield world
    for one in worlds:
        one.close()


@pytest.mark.parametrize("name", FAULTS)
def test_the_robot_stops_in_time(name):
    """Noticed times are those of a heartbeat (0.1 s), the watchdog (0.2 s), and of silence."""
    noticed, stood, problem = EXPECTED[name]
    stop = stop_after(FAULTS[name])
    assert stop.noticed <= noticed + LAG
    assert stop.stood <= stood + LAG
    assert stop.distance <= SPEED * stop.stood
    assert stop.problem.startswith(problem) and bool(stop.problem) == bool(problem)


def test_the_wheels_of_a_stiff_robot_stand_within_0_35_s_of_the_last_command():
    """Here with a drive of 1 ms, J / gain: the one of 10 ms needs 0.06 s more until it stands."""
    assert stop_after(FAULTS["brain frozen"], STIFF, gain=50.0).stood <= 0.35
    assert stop_after(FAULTS["brain frozen"], STIFF).stood <= 0.35 + 0.01 * log(636.0)


def test_a_fault_stands_until_it_is_cleared_and_the_robot_starts_gently(make):
    world = make()
    world.twist = SPEED
    world.run(2.0)
    world.axes[0].fail(0x2000)
    world.run(1.5)
    world.axes[0].error = 0
    world.run(1.0)
    assert world.feedback.problem == "node 0: MOTOR_OVER_TEMP"
    assert world.speeds == [0.0, 0.0]
    assert all(axis.state == AxisState.IDLE for axis in world.axes)
    world.driver.receive(CLEAR)
    fastest = 0.0
    for _ in range(round(1.5 * RATE)):
        before = world.speeds
        world.cycle()
        fastest = max(fastest, *(b - a for a, b in zip(before, world.speeds, strict=True)))
    assert world.feedback.problem == ""
    assert world.speeds == pytest.approx([SPEED, SPEED], rel=0.03)
    assert fastest <= SCOUT * 0.01 + 0.001  # of a setpoint to the next; it has not run ahead


def test_an_error_that_cannot_be_cleared_keeps_the_wheels_off(make):
    world = make()
    world.twist = SPEED
    world.axes[1].standing_error = 0x10
    world.axes[1].fail(0x10)
    world.run(0.5)
    world.driver.receive(CLEAR)
    world.run(4.0)
    assert "node 1 does not enter closed loop control: IDLE, BAD_CONFIG" in world.feedback.problem
    assert world.speeds == [0.0, 0.0]


def test_the_reason_of_an_axis_that_disarmed_itself_is_asked_for(make):
    world = make()
    world.twist = SPEED
    world.run(1.0)
    world.axes[1].fail(0x4000000)
    world.axes[1].error = 0  # the condition has gone; the axis stays disarmed
    world.run(0.3)
    wanted = "node 1 has left closed loop control: IDLE, disarmed by SPINOUT_DETECTED"
    assert world.feedback.problem == wanted


def test_a_loop_that_was_frozen_reports_what_is_wrong_and_not_its_own_silence(make):
    world = make()
    world.twist = SPEED
    world.run(1.0)
    world.loop_lives = False
    world.run(1.0)
    world.loop_lives = True
    world.run(0.3)
    assert world.feedback.problem == "node 0: WATCHDOG_TIMER_EXPIRED"
    world.run(1.0)
    assert world.speeds == [0.0, 0.0]


def test_what_a_frozen_loop_did_not_hear_is_no_silence(make):
    """The watchdog is longer here, and the bus keeps nothing of the 0.4 s."""
    world = make(watchdog=0.5)
    world.twist = SPEED
    world.run(1.0)
    for axis in world.axes:
        axis.watchdog = 0.5
    world.loop_lives = world.cable = False
    world.run(0.4)
    world.loop_lives = world.cable = True
    world.run(0.5)
    assert world.feedback.problem == ""
    assert world.state[LEVEL] == DRIVING


def test_a_stop_that_is_released_at_once_is_no_fault(make):
    """The last heartbeat then still says closed loop control, which the axes have just left."""
    world = make()
    for _ in range(9):  # of different phases of the heartbeats
        world.twist = SPEED
        world.run(1.012)
        world.stop = True
        while world.state[LEVEL] != OFF:
            world.cycle()
        world.cycle()
        world.stop = False
        world.run(1.0)
        assert world.feedback.problem == ""
        assert world.speeds == pytest.approx([SPEED, SPEED], rel=0.03)


def test_a_drive_that_restarts_does_not_move_the_odometry(make):
    world = make()
    world.twist = SPEED
    world.run(2.0)
    before = world.feedback.angles.copy()
    for axis in world.axes:
        axis.position -= 12000.0
    world.run(0.1)
    assert abs(world.feedback.angles - before).max() < 2.0 * SPEED * 0.1 / RADIUS


def test_angles_and_speeds_are_those_of_the_wheels(make):
    world = make(turns=(-4.0, 2.0))
    world.twist = 0.4
    first = [axis.position for axis in world.axes]
    began = world.feedback.angles.copy()
    world.run(3.0)
    rolled = [axis.position - place for axis, place in zip(world.axes, first, strict=True)]
    assert rolled[0] < 0.0 < rolled[1]
    expected = [2 * pi * rolled[0] / -4.0, 2 * pi * rolled[1] / 2.0]
    assert (world.feedback.angles - began).tolist() == pytest.approx(expected, abs=0.1)
    assert world.feedback.speeds == pytest.approx([4.0, 4.0], rel=0.03)
    assert world.state[LINEAR] == 0.4


def test_the_supply_is_told(make):
    world = make()
    world.run(1.0)
    kind, at, voltage, current = SUPPLY.unpack(list(world.driver.messages())[-1])
    assert (kind, voltage, current) == (b"S", 24.0, 0.5)
    assert world.now - 0.6 <= at <= world.now


def test_an_impossible_estimate_is_no_measurement(make):
    import can

    world = make()
    world.run(0.5)
    for velocity in (1e30, -1e6):
        forged = encode(EncoderEstimates(1e20, velocity))
        number = identifier(0, EncoderEstimates)
        world.bus.send(can.Message(arbitration_id=number, data=forged, is_extended_id=False))
    world.run(0.02)
    assert abs(world.feedback.speeds).max() < 0.1
    assert abs(world.feedback.angles).max() < 0.1
