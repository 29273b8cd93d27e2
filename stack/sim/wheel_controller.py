"""Wheel controller: velocity commands to wheel speeds, with rate limits and dead-man stop."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from stack.body import DEAD_MAN
from stack.compilation import KernelTypes
from stack.drivetrain.drivetrain import DriveState, Drivetrain, WheelCommand
from stack.drivetrain.kernels import CYCLE, cycle
from stack.drivetrain.wheel_loop import (
    ANGULAR,
    CHANGED,
    COMMAND,
    EFFORTS,
    ERRORS,
    INTEGRALS,
    LATERAL,
    LINEAR,
    MEASURED_SPEEDS,
    NO_GAINS,
    SILENCE,
    SPEEDS,
    STEERING,
    STEERING_ANGLES,
    STOP,
    WheelGains,
    block,
    loop_plan,
    loop_state,
)
from stack.types import STANDSTILL, Twist


class WheelController:
    """Runs the wheel loop of real robots (stack/drivetrain/kernels.py) once per physics step.

    Without gains the physics controls the speeds of the wheels; with gains the loop does, by their
    torques in newton metres.

    Args:
        drivetrain: of the robot.
        period: of the physics, seconds.
        gains: of the wheels.
    """

    def __init__(self, drivetrain: Drivetrain, period: float, gains: WheelGains = NO_GAINS) -> None:
        self._drivetrain, self._period = drivetrain, period
        self.controls_torques = gains != NO_GAINS
        self._dead_man_steps = round(DEAD_MAN / period)
        self._quiet_steps = self._dead_man_steps // 2
        self._plan = loop_plan(drivetrain, DEAD_MAN, inf, gains)
        self._state = loop_state(self._plan, period)
        self._speeds, self._efforts = block(self._state, SPEEDS), block(self._state, EFFORTS)
        self._measured = block(self._state, MEASURED_SPEEDS)
        self._command = STANDSTILL
        self._steps_since_command = self._dead_man_steps
        self._settled, self._is_stopped = True, False

    @staticmethod
    def kernels() -> KernelTypes:
        """Compiled functions of `advance`."""
        return CYCLE

    def command(self, twist: Twist, emergency_stop: bool = False) -> None:
        """Set the target velocity; the loop limits it to what the drive can do.

        Args:
            twist: base frame.
            emergency_stop: whether to stop at once instead.
        """
        self._state[STOP] = emergency_stop
        if twist != self._command or self._steps_since_command > self._quiet_steps:
            self._command, self._settled = twist, False
            self._state[COMMAND : COMMAND + 3] = twist.linear, twist.angular, twist.lateral
        if emergency_stop != self._is_stopped:
            self._is_stopped, self._settled = emergency_stop, False
        self._steps_since_command = 0

    def halt(self) -> None:
        """Reset target and setpoint to zero without a ramp, after the robot was lifted."""
        self._command, self._settled = STANDSTILL, True
        self._state[COMMAND : COMMAND + 3] = 0.0
        self._state[LINEAR] = self._state[ANGULAR] = self._state[LATERAL] = 0.0
        for memory in (INTEGRALS, ERRORS):
            block(self._state, memory)[:] = 0.0

    def torques(self, speeds: Sequence[float]) -> Sequence[float]:
        """Advance by one physics step; return the torques of the driven wheels, N m.

        Args:
            speeds: measured, of the driven wheels, rad/s.
        """
        self._measured[:] = speeds
        self._settled = False
        self.advance()
        torques: list[float] = self._efforts.tolist()
        return torques

    def advance(self) -> bool:
        """Advance by one physics step; return whether wheel speeds or steering changed."""
        self._steps_since_command += 1
        if self._quiet_steps < self._steps_since_command <= self._dead_man_steps + 1:
            self._settled = False
        if self._settled:
            return False
        self._state[SILENCE] = self._steps_since_command * self._period
        cycle(self._plan, self._state)
        self._settled = not self._state[CHANGED]
        return not self._settled

    def skip(self, steps: int) -> bool:
        """Advance by `steps` physics steps if nothing changes in them; return whether it did."""
        is_quiet = self._steps_since_command + steps <= self._quiet_steps
        has_stopped = self._steps_since_command > self._dead_man_steps
        if self.controls_torques or not self._settled or not (is_quiet or has_stopped):
            return False
        self._steps_since_command += steps
        return True

    @property
    def setpoint(self) -> DriveState:
        """Current velocity, and steering of a drive with steered wheels."""
        linear, angular, lateral, steering = self._state[LINEAR : STEERING + 1].tolist()
        is_steered = bool(self._drivetrain.steering_joints)
        return DriveState(Twist(linear, angular, lateral), steering if is_steered else None)

    @property
    def wheels(self) -> WheelCommand:
        """Setpoints of the wheels."""
        steering: tuple[float, ...] = ()
        if self._drivetrain.steering_joints:
            steering = tuple(self._state[STEERING_ANGLES : STEERING_ANGLES + 2].tolist())
        return WheelCommand(tuple(self._speeds.tolist()), steering)
