"""The compiled wheel loop: the drivetrains' own laws, jerk limits, the stop, control of efforts."""

from math import cos, inf, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.differential import Wheels
from stack.drivetrain.kernels import cycle
from stack.drivetrain.limits import Limits
from stack.drivetrain.omnidirectional import OmniWheels
from stack.drivetrain.skid_steered import SkidWheels
from stack.drivetrain.wheel_loop import (
    ACCELERATION,
    COMMAND,
    DRIVING,
    EFFORTS,
    LEVEL,
    LEVER,
    LINEAR,
    MEASURED_SPEEDS,
    OFF,
    RELEASE,
    SILENCE,
    SPEEDS,
    STEERING,
    STEERING_ANGLES,
    STOP,
    STOPPING,
    WheelGains,
    block,
    loop_plan,
    loop_state,
)
from stack.types import Pose2D, Twist

LIMITS = Limits(linear_speed=1.0, reverse_speed=0.5)
SIDE = Limits(lateral_speed=0.6)
STAR = OmniWheels(
    ("a", "b", "c"),
    tuple(Pose2D(0.2 * cos(a), 0.2 * sin(a), a + pi / 2) for a in (0.0, 2.0, 4.0)), 0.05,
)  # fmt: skip
DIFFERENTIAL = Wheels(("l", "m"), ("r", "s"), 0.075, 0.29)
SKID = SkidWheels(("l", "m"), ("r", "s"), 0.1, 0.4, 0.6)
CAR = SteeredWheels(("a", "b"), ("c", "d"), 0.1, 0.5, 0.4, pi / 6, 1.0)
DRIVES = {
    "differential": DIFFERENTIAL.drivetrain(LIMITS),
    "skid": SKID.drivetrain(LIMITS),
    "omni": STAR.drivetrain(SIDE),
    "car": CAR.drivetrain(LIMITS),
}
PERIOD = 0.002
NO_GAINS = WheelGains()
TWISTS = st.tuples(*[st.sampled_from([0.0, 0.3, -0.2]) | st.floats(-2.0, 2.0)] * 3)


@pytest.mark.parametrize("kind", DRIVES)
@given(twists=st.lists(TWISTS, min_size=1, max_size=6))
@settings(max_examples=60, deadline=None)
def test_it_is_the_drivetrain_s_law_to_the_last_bit(kind, twists):
    drive = DRIVES[kind]
    plan = loop_plan(drive, 0.3, inf)
    state, expected = loop_state(plan, PERIOD), drive.at_rest
    state[SILENCE] = 0.0
    for linear, angular, lateral in twists:
        state[COMMAND : COMMAND + 3] = linear, angular, lateral
        target = drive.feasible(drive.limits.clipped(Twist(linear, angular, lateral)))
        for _ in range(40):
            cycle(plan, state)
            expected = drive.limit_step(expected, target, PERIOD)
        now = expected.twist
        assert state[LINEAR : LINEAR + 3].tolist() == [now.linear, now.angular, now.lateral]
        assert state[STEERING] == (expected.steering or 0.0)
        wheels = drive.to_wheels(expected)
        assert tuple(block(state, SPEEDS).tolist()) == wheels.speeds
        if wheels.steering:
            angles = state[STEERING_ANGLES : STEERING_ANGLES + 2].tolist()
            assert tuple(angles) == wheels.steering


@given(targets=st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=5), jerk=st.floats(0.5, 50.0))
@settings(max_examples=100, deadline=None)
def test_the_acceleration_changes_no_faster_than_the_jerk(targets, jerk):
    limits = Limits(linear_speed=1.0, reverse_speed=1.0, linear_jerk=jerk, angular_jerk=jerk)
    plan = loop_plan(Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(limits), 0.3, inf)
    state = loop_state(plan, PERIOD)
    state[SILENCE] = 0.0
    for target in targets:
        state[COMMAND] = target
        start, highest, lowest = state[LINEAR], state[LINEAR], state[LINEAR]
        accelerating = state[ACCELERATION]
        for _ in range(4000):
            before = state[ACCELERATION]
            cycle(plan, state)
            assert abs(state[ACCELERATION] - before) <= jerk * PERIOD * (1.0 + 1e-6)
            assert abs(state[ACCELERATION]) <= 1.5 + 1e-9  # the deceleration of the limits
            highest, lowest = max(highest, state[LINEAR]), min(lowest, state[LINEAR])
        assert state[LINEAR] == pytest.approx(target, abs=1e-6)
        if accelerating == 0.0:  # from a constant speed it does not overshoot
            step = (
                jerk * PERIOD**2 / 8.0 + 1e-9
            )  # of a fall of the acceleration that is no multiple
            assert min(start, target) - step <= lowest <= highest <= max(start, target) + step


def test_a_ramp_with_jerk_takes_the_time_of_the_closed_form():
    """v / a + a / j = 0.5 / 1.0 + 1.0 / 4.0 s, of which the last 2 ms are one step."""
    limits = Limits(linear_jerk=4.0)
    plan = loop_plan(Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(limits), 0.3, inf)
    state = loop_state(plan, PERIOD)
    state[SILENCE], state[COMMAND] = 0.0, 0.5
    steps = 0
    while state[LINEAR] < 0.5 - 1e-6:
        cycle(plan, state)
        steps += 1
    assert steps * PERIOD == pytest.approx(0.75, abs=0.01)


def scout(gains=NO_GAINS, torque_off=2.0):
    plan = loop_plan(Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(LIMITS), 0.3, torque_off, gains)
    return plan, loop_state(plan, 0.001)


def test_without_commands_it_stops_and_then_releases_the_wheels():
    plan, state = scout()
    state[COMMAND] = 1.0
    levels, speeds = [], []
    for step in range(3600):
        state[SILENCE] = max(0.0, (step - 1400) * 0.001)
        cycle(plan, state)
        levels.append(state[LEVEL])
        speeds.append(state[LINEAR])
    assert levels.index(STOPPING) == 1551  # 0.15 s later
    assert speeds.index(0.0) == 1551 + 333  # 1.0 m/s at 3 m/s²
    assert levels.index(OFF) == 3401  # 2 s later
    state[SILENCE] = 0.0
    cycle(plan, state)
    assert state[LEVEL] == DRIVING


def test_a_robot_that_needs_longer_to_stop_is_not_released_before():
    plan, state = scout(torque_off=0.5)
    state[COMMAND], state[SILENCE] = 1.0, 0.0
    for _ in range(1500):
        cycle(plan, state)
    for step in range(330):
        state[SILENCE] = 1.0 + step * 0.001
        cycle(plan, state)
        assert state[LEVEL] == STOPPING


def rims(state, kind):
    """Speeds of the rims of the driven wheels, m/s."""
    return (
        np.abs(block(state, SPEEDS))
        * {"differential": 0.075, "skid": 0.1, "omni": 0.05, "car": 0.1}[kind]
    )


@pytest.mark.parametrize("kind", DRIVES)
@given(twist=TWISTS, jerk=st.sampled_from([0.0, 2.0]), stop=st.floats(0.5, 12.0))
@settings(max_examples=60, deadline=None)
def test_no_wheel_slows_down_faster_than_a_stop_and_the_path_stays(kind, twist, jerk, stop):
    wheels = {"differential": DIFFERENTIAL, "skid": SKID, "omni": STAR, "car": CAR}[kind]
    limits = Limits(lateral_speed=0.6, linear_jerk=jerk, angular_jerk=jerk, stop_deceleration=stop)
    plan = loop_plan(wheels.drivetrain(limits), 0.3, inf)
    state = loop_state(plan, PERIOD)
    state[SILENCE], state[COMMAND : COMMAND + 3] = 0.0, twist
    for _ in range(400):
        cycle(plan, state)
    began = state[LINEAR : LINEAR + 3].copy()
    most = max(stop, 1.5)
    needs = (np.hypot(began[0], began[2]) + plan[LEVER] * abs(began[1])) / most
    state[STOP], steps = 1.0, 0
    while state[LINEAR : LINEAR + 3].any():
        before = rims(state, kind)
        cycle(plan, state)
        # A car's outer wheel is faster than its middle, by at most the share of its tightest turn.
        allowed = most * PERIOD * (1.0 if kind != "car" else 1.0 + 0.2 * np.tan(pi / 6) / 0.5)
        assert np.all(before - rims(state, kind) <= allowed * (1 + 1e-9) + 1e-12)
        assert np.cross(began, state[LINEAR : LINEAR + 3]) == pytest.approx(0.0, abs=1e-9)
        steps += 1
    assert steps * PERIOD == pytest.approx(needs, abs=1.01 * PERIOD)


def test_a_robot_drives_on_with_the_next_command_and_no_jerk_that_it_had_in_the_stop():
    limits = Limits(linear_speed=1.0, linear_jerk=5.0)
    plan = loop_plan(Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(limits), 0.3, inf)
    state = loop_state(plan, PERIOD)
    state[SILENCE], state[COMMAND] = 0.0, 1.0
    for _ in range(1000):
        cycle(plan, state)
    for step in range(100):
        state[SILENCE] = 0.1 + step * PERIOD
        cycle(plan, state)
    slowest = state[LINEAR]
    assert slowest == pytest.approx(1.0 - 3.0 * 0.15, abs=0.01)  # from 0.15 s on
    state[SILENCE] = 0.0
    for _ in range(100):
        cycle(plan, state)
        assert state[LINEAR] >= slowest


@pytest.mark.parametrize(("turning", "released"), [(0.0, 1), (0.5, 500)])
def test_a_stop_releases_wheels_that_stand_and_others_after_half_a_second(turning, released):
    plan, state = scout()
    state[SILENCE], state[STOP] = 0.0, 1.0
    block(state, MEASURED_SPEEDS)[1] = turning
    levels = []
    for _ in range(600):
        cycle(plan, state)
        levels.append(state[LEVEL])
    assert levels.index(OFF) == pytest.approx(released, abs=1)  # 0.5 s of 1 ms, rounded


def test_a_release_takes_the_torque_at_once():
    plan, state = scout(WheelGains(p=1.0))
    state[COMMAND], state[SILENCE] = 1.0, 0.0
    for _ in range(100):
        cycle(plan, state)
    assert block(state, EFFORTS).all()
    state[RELEASE] = 1.0
    cycle(plan, state)
    assert state[LEVEL] == OFF
    assert not block(state, EFFORTS).any()
    assert not state[LINEAR]


def test_a_saturated_effort_does_not_wind_up():
    """A wheel is held for two seconds; released, it does not overshoot by more than 10 %."""
    gains = WheelGains(p=0.2, i=2.0, speed=0.05, most=0.5)
    plan, state = scout(gains)
    state[COMMAND], state[SILENCE] = 0.5, 0.0
    measured, highest = block(state, MEASURED_SPEEDS), 0.0
    for step in range(6000):
        cycle(plan, state)
        efforts = block(state, EFFORTS)
        assert abs(efforts).max() <= 0.5
        if step > 2000:  # J dw/dt = effort - d w
            measured += 0.001 * (efforts - 0.05 * measured) / 0.02
            highest = max(highest, measured.max())
    assert measured == pytest.approx([5.0, 5.0], rel=1e-3)
    assert highest < 5.5


def test_feed_forward_alone_is_the_speed_times_its_gain_and_the_friction():
    plan, state = scout(WheelGains(speed=0.05, friction=0.1))
    state[COMMAND], state[SILENCE] = -0.5, 0.0
    for _ in range(600):
        cycle(plan, state)
    assert block(state, EFFORTS) == pytest.approx([-0.05 * 5.0 - 0.1] * 2)
    assert np.all(block(state, SPEEDS) == -5.0)
