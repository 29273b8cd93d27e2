"""Wheel controller: velocity commands to wheel speeds, with rate limits and dead-man stop."""

from __future__ import annotations

from stack.body import DEAD_MAN
from stack.drivetrain.drivetrain import DriveState, Drivetrain, WheelCommand
from stack.types import STANDSTILL, Twist


class WheelController:
    """Moves the setpoint of a drivetrain to the commanded velocity, once per physics step.

    Attributes:
        setpoint: current velocity and steering.
    """

    def __init__(self, drivetrain: Drivetrain, period: float) -> None:
        self._drivetrain, self._period = drivetrain, period
        self._dead_man_steps = round(DEAD_MAN / period)
        self._target = STANDSTILL
        self._steps_since_command = self._dead_man_steps
        self._settled = True
        self.setpoint = drivetrain.at_rest

    def command(self, twist: Twist) -> None:
        """Set the target velocity, limited to what the drive can do."""
        self._approach(self._drivetrain.feasible(self._drivetrain.limits.clipped(twist)))
        self._steps_since_command = 0

    def halt(self) -> None:
        """Reset target and setpoint to zero without a ramp, after the robot was lifted."""
        self._target, self._settled = STANDSTILL, True
        self.setpoint = DriveState(STANDSTILL, self.setpoint.steering)

    def advance(self) -> bool:
        """Advance by one physics step; return whether wheel speeds or steering changed."""
        self._steps_since_command += 1
        if self._steps_since_command > self._dead_man_steps:
            self._approach(STANDSTILL)
        if self._settled:
            return False
        last = self.setpoint
        self.setpoint = self._drivetrain.limit_step(last, self._target, self._period)
        self._settled = self.setpoint == last
        return not self._settled

    def skip(self, steps: int) -> bool:
        """Advance by `steps` physics steps if nothing changes in them; return whether it did."""
        if not self._settled or self._steps_since_command + steps > self._dead_man_steps:
            return False
        self._steps_since_command += steps
        return True

    @property
    def wheels(self) -> WheelCommand:
        """Setpoints of the wheels."""
        return self._drivetrain.to_wheels(self.setpoint)

    def _approach(self, target: Twist) -> None:
        if target != self._target:
            self._target, self._settled = target, False
