"""Compiled wheel loop: limits of the twist, wheel speeds, efforts, and the stop without commands.

The arrays are described in wheel_loop.py. The laws of limits and kinematics are the functions that
the drivetrains themselves call, compiled; the arithmetic is the same to the last bit.
"""

from __future__ import annotations

from math import copysign, sqrt, tan

from numba import f8

from stack.drivetrain.ackermann import STEERED_FROM, rolling_wheels, steered, steering_of
from stack.drivetrain.limits import limit_speed
from stack.drivetrain.omnidirectional import share_of_change
from stack.drivetrain.wheel_loop import (
    ACCELERATION,
    ANGULAR,
    ANGULAR_JERK,
    ANGULAR_SPEED,
    CHANGED,
    COMMAND,
    D_GAIN,
    DEAD_MAN,
    DIVISOR,
    DRIVING,
    EFFORTS,
    ERRORS,
    FALL,
    FRICTION,
    HALF_STEERED,
    HOLDS,
    I_GAIN,
    INTEGRALS,
    LATERAL,
    LATERAL_SPEED,
    LEVEL,
    LEVER,
    LINEAR,
    LINEAR_JERK,
    LINEAR_SPEED,
    MEASURED_SPEEDS,
    MOST_EFFORT,
    MOST_STEERING,
    OFF,
    P_GAIN,
    PER_WHEEL,
    PERIOD,
    RADIUS,
    RELEASE,
    REST,
    REVERSE_SPEED,
    RISE,
    ROWS,
    SIDEWAYS,
    SILENCE,
    SPEED_GAIN,
    SPEEDS,
    STEERED,
    STEERING,
    STEERING_ANGLES,
    STEERING_RATE,
    STOOD,
    STOP,
    STOP_DECELERATION,
    STOPPING,
    TORQUE_OFF,
    TRACK,
    TURN,
    TURNING_RADIUS,
    WHEELBASE,
    WHEELS,
)
from stack.kernel_cache import njit

_limit_speed = njit(cache=True, nogil=True)(limit_speed)
_share_of_change = njit(cache=True, nogil=True)(share_of_change)
_steering_of = njit(cache=True, nogil=True)(steering_of)
_steered = njit(cache=True, nogil=True)(steered)
_rolling_wheels = njit(cache=True, nogil=True)(rolling_wheels)


@njit(cache=True, nogil=True)
def cycle(plan, state):  # type: ignore[no-untyped-def]
    """Advance by one period: command and measurements in `state` become setpoints of the wheels.

    Args:
        plan: of `loop_plan`.
        state: of `loop_state`.
    """
    level = _level(plan, state)
    if level == DRIVING:
        state[STOOD] = 0.0
        linear, angular, lateral = _feasible(plan, state)
        _advance_setpoint(plan, state, linear, angular, lateral)
    else:
        _stop(plan, state)
    if state[RELEASE] != 0.0 or (level == STOPPING and _is_done(plan, state)):
        level = OFF
        state[LINEAR] = state[ANGULAR] = state[LATERAL] = 0.0
        state[ACCELERATION : ACCELERATION + 3] = 0.0
    state[LEVEL] = level
    _set_wheels(plan, state)
    _control_efforts(plan, state)


@njit(cache=True, nogil=True)
def _level(plan, state):  # type: ignore[no-untyped-def]
    if state[STOP] != 0.0 or state[RELEASE] != 0.0:
        return STOPPING
    # Times are counted in cycles: half of one is nearer to this cycle than to the next.
    silence, limit = state[SILENCE] - state[PERIOD] / 2.0, plan[DEAD_MAN]
    if silence <= limit / 2.0:
        return DRIVING
    # Once it has begun it goes on: while it stops, what it needs falls as fast as what is left.
    if state[LEVEL] == STOPPING or silence + _stop_time(plan, state) > limit:
        return STOPPING
    return DRIVING


@njit(cache=True, nogil=True)
def _stop_time(plan, state):  # type: ignore[no-untyped-def]
    """Seconds until it stands, if the fastest wheel slows down at STOP_DECELERATION."""
    speed = sqrt(state[LINEAR] * state[LINEAR] + state[LATERAL] * state[LATERAL])
    return (speed + plan[LEVER] * abs(state[ANGULAR])) / plan[STOP_DECELERATION]


@njit(cache=True, nogil=True)
def _stop(plan, state):  # type: ignore[no-untyped-def]
    """Slow down along the path that it drives, whatever the limits of jerk."""
    left, period = _stop_time(plan, state), state[PERIOD]
    share = 1.0 - period / left if left > period else 0.0
    state[LINEAR] *= share
    state[ANGULAR] *= share
    state[LATERAL] *= share
    state[ACCELERATION : ACCELERATION + 3] = 0.0
    state[CHANGED] = 1.0 if left > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _is_done(plan, state):  # type: ignore[no-untyped-def]
    """Whether wheels that stop can be released: not while the robot would roll on."""
    if state[LINEAR] != 0.0 or state[ANGULAR] != 0.0 or state[LATERAL] != 0.0:
        state[STOOD] = 0.0
        return False
    state[STOOD] += state[PERIOD]
    if state[STOP] == 0.0:
        return state[SILENCE] > plan[TORQUE_OFF]
    first = PER_WHEEL + MEASURED_SPEEDS * int(plan[WHEELS])
    for wheel in range(int(plan[WHEELS])):
        if abs(state[first + wheel]) > REST:
            return state[STOOD] > HOLDS
    return True


@njit(cache=True, nogil=True)
def _feasible(plan, state):  # type: ignore[no-untyped-def]
    """`Limits.clipped` and `Drivetrain.feasible` of the command."""
    linear = min(max(state[COMMAND], -plan[REVERSE_SPEED]), plan[LINEAR_SPEED])
    angular = min(max(state[COMMAND + 1], -plan[ANGULAR_SPEED]), plan[ANGULAR_SPEED])
    lateral = 0.0
    if plan[SIDEWAYS] != 0.0:
        lateral = min(max(state[COMMAND + 2], -plan[LATERAL_SPEED]), plan[LATERAL_SPEED])
    if plan[STEERED] != 0.0:
        most = abs(linear) / plan[TURNING_RADIUS]
        angular = min(max(angular, -most), most)
    return linear, angular, lateral


@njit(cache=True, nogil=True)
def _advance_setpoint(plan, state, linear, angular, lateral):  # type: ignore[no-untyped-def]
    """`Drivetrain.limit_step` to a wanted twist, then the limits of jerk."""
    period, rise, fall = state[PERIOD], plan[RISE], plan[FALL]
    was_linear, was_angular, was_lateral = state[LINEAR], state[ANGULAR], state[LATERAL]
    was_steering = steering = state[STEERING]
    goal_linear, goal_angular, goal_lateral = linear, angular, lateral
    if plan[SIDEWAYS] != 0.0:
        share = _share_of_change(
            was_linear, was_lateral, linear, lateral,
            _distance(linear - was_linear, lateral - was_lateral), period, rise, fall,
        )  # fmt: skip
        if share < 1.0:
            linear = was_linear + share * (linear - was_linear)
            lateral = was_lateral + share * (lateral - was_lateral)
    else:
        if plan[STEERED] != 0.0 and abs(linear) >= STEERED_FROM:
            target = _steering_of(linear, angular, plan[WHEELBASE], plan[MOST_STEERING])
            change = plan[STEERING_RATE] * period
            steering, linear = _steered(was_linear, steering, linear, target, change)
            goal_linear = linear
        linear = _limit_speed(was_linear, linear, period, rise, fall)
    jerk = plan[LINEAR_JERK]
    if jerk > 0.0:
        before, aside = state[ACCELERATION], state[ACCELERATION + 2]
        linear = _limit_jerk(was_linear, linear, goal_linear, before, jerk, period)
        lateral = _limit_jerk(was_lateral, lateral, goal_lateral, aside, jerk, period)
    jerk = plan[ANGULAR_JERK]
    if plan[STEERED] != 0.0:
        angular = linear * (tan(steering) / plan[WHEELBASE])
    else:
        angular = _limit_speed(was_angular, angular, period, plan[TURN], plan[TURN])
        if jerk > 0.0:
            before = state[ACCELERATION + 1]
            angular = _limit_jerk(was_angular, angular, goal_angular, before, jerk, period)
    state[ACCELERATION] = (linear - was_linear) / period
    state[ACCELERATION + 1] = (angular - was_angular) / period
    state[ACCELERATION + 2] = (lateral - was_lateral) / period
    state[LINEAR], state[ANGULAR], state[LATERAL] = linear, angular, lateral
    state[STEERING] = steering
    same = linear == was_linear and angular == was_angular and lateral == was_lateral
    state[CHANGED] = 0.0 if same and steering == was_steering else 1.0


@njit(cache=True, nogil=True)
def _distance(x, y):  # type: ignore[no-untyped-def]
    """Length of a vector, correctly rounded but for rare ties, as Python's `hypot`.

    The C library's differs from it in the last bit in one of 200 cases. Here the error of the
    squares, found with Dekker's exact products, corrects the root once.
    """
    length = sqrt(x * x + y * y)
    if length == 0.0:
        return length
    error = _square_error(x) + _square_error(y) - _square_error(length)
    xx, yy, ll = x * x, y * y, length * length
    larger, smaller = max(xx, yy), min(xx, yy)
    left = (larger - ll) + smaller  # exact: ll is near larger + smaller, at most twice larger
    return length + (left + error) / (2.0 * length)


@njit(cache=True, nogil=True)
def _square_error(x):  # type: ignore[no-untyped-def]
    """What x² lacks after rounding; exact within the range of speeds (Dekker 1971)."""
    c = 134217729.0 * x
    high = c - (c - x)
    low = x - high
    return ((high * high - x * x) + 2.0 * high * low) + low * low


@njit(cache=True, nogil=True)
def _limit_jerk(was, now, goal, acceleration, jerk, period):  # type: ignore[no-untyped-def]
    """Speed after one period: the acceleration changes at most by jerk * period.

    It also stays so small that it can fall to zero until the goal is reached: it falls in steps, so
    that a h / 2 + a² / (2 j) <= |goal - was| with the period h. The last step may pass the goal by
    j h² / 8, micrometres per second.

    Args:
        was: speed before the period.
        now: speed after it by the limit of acceleration.
        goal: speed that is wanted in the end.
        acceleration: in the last period.
        jerk: limit.
        period: seconds.
    """
    step = jerk * period
    most = sqrt(step * step / 4.0 + 2.0 * jerk * abs(goal - was)) - step / 2.0
    wanted = min(max((now - was) / period, -most), most)
    return was + period * min(max(wanted, acceleration - step), acceleration + step)


@njit(cache=True, nogil=True)
def _set_wheels(plan, state):  # type: ignore[no-untyped-def]
    """`Drivetrain.to_wheels` of the setpoint."""
    wheels = int(plan[WHEELS])
    linear, angular, lateral = state[LINEAR], state[ANGULAR], state[LATERAL]
    if plan[STEERED] != 0.0:
        curvature = tan(state[STEERING]) / plan[WHEELBASE]
        left, right, left_angle, right_angle = _rolling_wheels(
            linear, curvature, plan[WHEELBASE], plan[TRACK], plan[HALF_STEERED], plan[RADIUS]
        )
        state[PER_WHEEL], state[PER_WHEEL + 1] = left, right
        state[STEERING_ANGLES], state[STEERING_ANGLES + 1] = left_angle, right_angle
        return
    for wheel in range(wheels):
        row = ROWS + 3 * wheel
        along = plan[row] * linear + plan[row + 1] * lateral + plan[row + 2] * angular
        state[PER_WHEEL + SPEEDS * wheels + wheel] = along / plan[DIVISOR]


@njit(cache=True, nogil=True)
def _control_efforts(plan, state):  # type: ignore[no-untyped-def]
    """PID with feed-forward; a saturated effort integrates only what takes it back."""
    wheels, period = int(plan[WHEELS]), state[PERIOD]
    for wheel in range(wheels):
        at = PER_WHEEL + wheel
        wanted, measured = state[at + SPEEDS * wheels], state[at + MEASURED_SPEEDS * wheels]
        error = wanted - measured
        if state[LEVEL] == OFF:
            state[at + EFFORTS * wheels] = state[at + INTEGRALS * wheels] = 0.0
            state[at + ERRORS * wheels] = 0.0
            continue
        ahead = plan[SPEED_GAIN] * wanted
        if wanted != 0.0:
            ahead += copysign(plan[FRICTION], wanted)
        integral = state[at + INTEGRALS * wheels] + plan[I_GAIN] * error * period
        rate = (error - state[at + ERRORS * wheels]) / period
        effort = ahead + plan[P_GAIN] * error + integral + plan[D_GAIN] * rate
        most = plan[MOST_EFFORT]
        if abs(effort) <= most or effort * error < 0.0:
            state[at + INTEGRALS * wheels] = integral
        state[at + EFFORTS * wheels] = min(max(effort, -most), most)
        state[at + ERRORS * wheels] = error


CYCLE = ((cycle, (f8[::1], f8[::1])),)
"""The entry point, with the types that the loops call it with."""
