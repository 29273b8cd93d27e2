"""Velocity smoother: limits speed and acceleration to those of the drive."""

from __future__ import annotations

from math import copysign

from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import scaled, share_within_limits
from stack.types import STANDSTILL, Twist

ON_ARC = 1e-6
"""Difference, m/s and rad/s, up to which two twists count as equal."""


class VelocitySmoother:
    """Limits the change of commands in each control period to what the drivetrain can do."""

    def __init__(self, robot: RobotDescription, period: float) -> None:
        self._drivetrain, self._period = robot.drivetrain, period
        self._state = self._drivetrain.at_rest

    def continue_from(self, twist: Twist) -> None:
        """Limit the next command from this one: the last, or the measured velocity."""
        self._state = self._drivetrain.state_at(twist, self._state)

    def towards(self, wanted: Twist) -> Twist:
        """Return the reachable twist nearest to the wanted one."""
        return self._drivetrain.limit_step(self._state, wanted, self._period).twist

    def along(self, wanted: Twist) -> Twist | None:
        """Return the reachable twist on the wanted arc.

        `towards` reaches each component as fast as it can, so that the robot starts on another arc:
        usually a tighter one, because turning needs less time than driving off.

        Returns:
            The wanted twist times the share that the slowest component reaches; None if the robot
            moves on another arc and cannot be on this one after one period.
        """
        shares = _shares(self.towards(wanted), wanted)
        candidate = scaled(wanted, max(0.0, min(shares, default=0.0)))
        reachable = self.towards(candidate)
        return reachable if are_close(reachable, candidate) else None

    def braked(self) -> Twist:
        """Return the previous command as slow as it can be on its arc.

        `towards(STANDSTILL)` slows each component down as fast as it can, so that the robot leaves
        its arc: it usually turns on after it has stopped driving.
        """
        last = self._state.twist
        shares = _shares(self.towards(STANDSTILL), last)
        return self.towards(scaled(last, max(shares, default=0.0)))


def _shares(reached: Twist, whole: Twist) -> list[float]:
    """Return the share of each component of a twist that is reached; none for those of 0."""
    pairs = (
        (reached.linear, whole.linear),
        (reached.angular, whole.angular),
        (reached.lateral, whole.lateral),
    )
    return [part / wanted for part, wanted in pairs if wanted != 0.0]


def are_close(one: Twist, other: Twist) -> bool:
    """Tell whether two twists count as equal."""
    off = max(
        abs(one.linear - other.linear),
        abs(one.angular - other.angular),
        abs(one.lateral - other.lateral),
    )
    return off < ON_ARC


def within_limits(twist: Twist, robot: RobotDescription, top_speed: float) -> Twist:
    """Scale a twist to the robot's limits and the top speed (m/s); the arc stays the same.

    Arcs tighter than a car's turning radius are replaced by its tightest arc.
    """
    possible = robot.drivetrain.feasible(twist)
    share = share_within_limits(possible, robot.limits, top_speed)
    return possible if share == 1.0 else scaled(possible, share)


def beyond_dead_band(smooth: Twist, wanted: Twist, linear: float, angular: float) -> Twist:
    """Replace speeds inside the dead band of the drive.

    A speed inside the band becomes the edge of the band while the wanted speed is beyond it, and
    zero otherwise: the drive starts to move, and gets no command that it cannot follow.

    Args:
        smooth: smoothed velocity.
        wanted: target of the smoother.
        linear: edge of the band, m/s.
        angular: edge of the band, rad/s.
    """
    return Twist(
        _beyond(smooth.linear, wanted.linear, linear),
        _beyond(smooth.angular, wanted.angular, angular),
        _beyond(smooth.lateral, wanted.lateral, linear),
    )


def arc_beyond_dead_band(smooth: Twist, wanted: Twist, linear: float) -> Twist:
    """As `beyond_dead_band` for a car, on the same arc: a car turns only while it drives."""
    speed = _beyond(smooth.linear, wanted.linear, linear)
    return scaled(smooth, speed / smooth.linear) if smooth.linear else STANDSTILL


def _beyond(smooth: float, wanted: float, band: float) -> float:
    if abs(smooth) >= band:
        return smooth
    return copysign(band, smooth) if smooth * wanted > 0.0 and abs(wanted) >= band else 0.0
