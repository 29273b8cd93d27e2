"""Numbers of the wheel loop: what its kernel reads and writes, in two arrays of float64.

The plan is constant: limits, kinematics, gains. The state is the loop's memory between two cycles:
commands and measurements are written into it, setpoints are read from it. The simulated body and
the fast loop of real robots run the same kernel (stack/drivetrain/kernels.py) on such arrays, and
the fast loop hands the state to the brain as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf

import numpy as np

from stack.drivetrain.drivetrain import Drivetrain, WheelLaw
from stack.drivetrain.limits import Limits
from stack.parameters import parameter
from stack.types import FloatArray

# Of the plan.
WHEELS, SIDEWAYS, STEERED, DIVISOR = 0, 1, 2, 3
"""Number of driven wheels; whether it moves sideways, is steered; as of `WheelLaw`."""
LIMITS = 4
"""The fields of `Limits`, in order, but for `stop_deceleration`."""
LINEAR_SPEED, REVERSE_SPEED, LATERAL_SPEED, ANGULAR_SPEED = 4, 5, 6, 7
RISE, FALL, TURN, LINEAR_JERK, ANGULAR_JERK = 8, 9, 10, 11, 12
STEERING_LAW = 13
"""`WheelLaw.steering`."""
WHEELBASE, TRACK, HALF_STEERED, RADIUS, MOST_STEERING, STEERING_RATE, TURNING_RADIUS = range(13, 20)
DEAD_MAN, TORQUE_OFF = 20, 21
"""Seconds without a command after which it stands, and after which standing wheels are released."""
GAINS = 22
"""The fields of `WheelGains`, in order."""
P_GAIN, I_GAIN, D_GAIN, SPEED_GAIN, FRICTION, MOST_EFFORT = range(22, 28)
STOP_DECELERATION, LEVER = 28, 29
"""Of the fastest wheel in a stop, m/s²; metres per radian by which turning moves it; 0: steered."""
ROWS = 30
"""`WheelLaw.rows`, three numbers for each wheel."""

# Of the state: inputs.
PERIOD, SILENCE, STOP, RELEASE = 0, 1, 2, 3
"""Seconds of this cycle; seconds since the last command; whether to stop and then release the
wheels; whether to release them at once."""
COMMAND = 4
"""Linear, angular and lateral velocity, as commanded."""
# Of the state: results.
LINEAR, ANGULAR, LATERAL, STEERING = 7, 8, 9, 10
"""Setpoint of the drive: m/s, rad/s, m/s, radians (nan: unknown)."""
ACCELERATION = 11
"""Of linear, angular and lateral velocity in the last cycle."""
LEVEL, CHANGED = 14, 15
"""What the wheels do (DRIVING, STOPPING, OFF); whether the setpoint differs from the last cycle."""
STEERING_ANGLES, STEERING_MEASURED = 16, 18
"""Setpoints of the steered wheels and their measured angles, left and right, radians."""
STOOD = 20
"""Seconds for which the setpoint has been a standstill while it stops."""
PER_WHEEL = 21
"""Then, for all wheels: speeds wanted, rad/s; efforts; angles measured, radians; speeds measured,
rad/s; stamps of both, seconds; integral parts of the efforts; last errors, rad/s."""
SPEEDS, EFFORTS, ANGLES, MEASURED_SPEEDS, STAMPS, INTEGRALS, ERRORS = range(7)
"""Blocks of that."""

REST, HOLDS = 0.01, 0.5
"""Speed in rad/s below which a wheel stands; seconds for which wheels that still seem to turn are
held before they are released."""

DRIVING, STOPPING, OFF = 0, 1, 2
"""Levels: commands are obeyed; it stops; no torque."""


@dataclass(frozen=True)
class WheelGains:
    """Control of wheel speeds by effort, for drives that do not control speeds themselves.

    The effort is in the driver's unit: volts, newton metres or amperes. With all gains 0 the driver
    gets wheel speeds alone.
    """

    p: float = parameter(0.0, at_least=0.0, help="effort per rad/s of error")
    i: float = parameter(0.0, at_least=0.0, help="effort per radian of error: rad/s times seconds")
    d: float = parameter(0.0, at_least=0.0, help="effort per rad/s² of error")
    speed: float = parameter(0.0, at_least=0.0, help="effort per rad/s of the wanted speed")
    friction: float = parameter(0.0, at_least=0.0, help="effort that overcomes static friction")
    most: float = parameter(inf, above=0.0, help="largest effort")


NO_GAINS = WheelGains()
"""Of drives that control the speeds of their wheels themselves."""


def loop_plan(
    drivetrain: Drivetrain, dead_man: float, torque_off: float, gains: WheelGains = NO_GAINS
) -> FloatArray:
    """Return the plan of a drive.

    Args:
        drivetrain: with its limits.
        dead_man: seconds without a command after which it stands. It begins to stop when it must
            for that, but not before half of them: a fast robot then stands later.
        torque_off: seconds without a command after which wheels that stand are released.
        gains: of the wheels.
    """
    return plan_of(drivetrain.law, drivetrain.limits, dead_man, torque_off, gains)


def plan_of(
    law: WheelLaw, limits: Limits, dead_man: float, torque_off: float, gains: WheelGains
) -> FloatArray:
    """Return the plan of wheels with this law; as `loop_plan`."""
    plan = np.zeros(ROWS + 3 * len(law.rows))
    plan[WHEELS], plan[DIVISOR] = len(law.rows), law.divisor
    plan[SIDEWAYS], plan[STEERED] = law.moves_sideways, bool(law.steering)
    plan[LIMITS:STEERING_LAW] = (
        limits.linear_speed, limits.reverse_speed, limits.lateral_speed, limits.angular_speed,
        limits.linear_acceleration, limits.linear_deceleration, limits.angular_acceleration,
        limits.linear_jerk, limits.angular_jerk,
    )  # fmt: skip
    plan[STEERING_LAW : STEERING_LAW + len(law.steering)] = law.steering
    plan[DEAD_MAN], plan[TORQUE_OFF] = dead_man, torque_off
    plan[GAINS : GAINS + 6] = gains.p, gains.i, gains.d, gains.speed, gains.friction, gains.most
    plan[STOP_DECELERATION] = limits.stop
    if not law.steering:
        levers = (abs(turn) / hypot(ahead, aside) for ahead, aside, turn in law.rows)
        plan[LEVER] = max(levers, default=0.0)  # of a robot without wheels
    plan[ROWS:] = np.ravel(law.rows)
    return plan


def loop_state(plan: FloatArray, period: float) -> FloatArray:
    """Return the state of a loop that has never been commanded; `period` in seconds."""
    state = np.zeros(PER_WHEEL + 7 * int(plan[WHEELS]))
    state[PERIOD], state[SILENCE], state[LEVEL] = period, inf, OFF
    return state


def block(state: FloatArray, which: int) -> FloatArray:
    """Return a view on one number of each wheel: SPEEDS, EFFORTS, …"""
    wheels = (len(state) - PER_WHEEL) // 7
    return state[PER_WHEEL + which * wheels : PER_WHEEL + (which + 1) * wheels]
