"""Speed profiles for a robot with limited acceleration and a response delay."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from stack.drivetrain.drivetrain import Drivetrain
from stack.drivetrain.limits import Limits
from stack.types import Twist


def stopping_speed(distance: float, deceleration: float, delay: float) -> float:
    """Highest speed from which a robot with a response delay still stops within a distance.

    Args:
        distance: remaining metres or radians.
        deceleration: m/s² or rad/s².
        delay: seconds between a command and its effect.

    Returns:
        m/s or rad/s.
    """
    lost = deceleration * delay
    return sqrt(lost * lost + 2.0 * deceleration * max(0.0, distance)) - lost


@dataclass(frozen=True, slots=True)
class Ramp:
    """Limits the change of commands from one control step to the next.

    Attributes:
        drivetrain: of the robot.
        period: seconds between two commands.
        response_time: delay from a command to the robot's response, seconds.
    """

    drivetrain: Drivetrain
    period: float
    response_time: float

    @property
    def limits(self) -> Limits:
        """Limits of speed and acceleration."""
        return self.drivetrain.limits

    def rebased(self, last: Twist, measured: Twist) -> Twist:
        """Clip the last command to the measured velocity, plus the change possible in the delay."""
        limits, delay = self.limits, self.response_time + 2.0 * self.period
        slack = max(limits.linear_acceleration, limits.linear_deceleration) * delay
        turn_slack = limits.angular_acceleration * delay
        return Twist(
            _near(last.linear, measured.linear, slack),
            _near(last.angular, measured.angular, turn_slack),
            _near(last.lateral, measured.lateral, slack),
        )

    def towards(self, last: Twist, wanted: Twist) -> Twist:
        """One step from the last command towards the wanted one, on a drivable arc.

        Each component changes on its own. The base frame turns with the robot, so one limit for
        the velocity vector would pull a robot off its line that turns while it drives sideways.
        """
        reached = Twist(
            self.forward(last.linear, wanted.linear),
            self.turn(last.angular, wanted.angular),
            self.forward(last.lateral, wanted.lateral),
        )
        return self.drivetrain.feasible(reached)

    def forward(self, last: float, wanted: float) -> float:
        """One step of the forward speed towards the wanted one, m/s."""
        return self.limits.limit_linear(last, wanted, self.period)

    def turn(self, last: float, wanted: float) -> float:
        """One step of the turning speed towards the wanted one, rad/s."""
        within = _near(wanted, 0.0, self.limits.angular_speed)
        return self.limits.limit_angular(last, within, self.period)

    def stopped(self, last: Twist) -> Twist:
        """One step of braking on the current arc."""
        linear = self.forward(last.linear, 0.0)
        angular = last.angular * linear / last.linear if linear else self.turn(last.angular, 0.0)
        return self.drivetrain.feasible(Twist(linear, angular, self.forward(last.lateral, 0.0)))


def _near(value: float, centre: float, slack: float) -> float:
    return min(max(value, centre - slack), centre + slack)
