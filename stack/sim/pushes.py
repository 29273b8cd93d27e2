"""Pushes: a robot's body is moved along the floor while its wheels measure only their own motion.

While it lasts, the tyres have no friction, so that the wheels neither turn with the body nor hold
it. The body gets the velocity of the drive plus that of the push in each physics step; the contacts
of the physics stop it at obstacles. The displacement of the push follows s(u) = u - sin(2 pi u) /
(2 pi), u in [0, 1]: velocity and acceleration are zero at both ends, as of a shove by hand.
"""

from __future__ import annotations

from math import cos, hypot, pi, sin

from stack.sim.physics.engine import PhysicsRobot
from stack.sim.worlds.world import Push
from stack.types import Pose2D, Twist

BLOCKED = 0.5
"""A push ends if the body has less than this share of the velocity that it got."""

TURNING_ARM = 0.2
"""Metres: arm by which a turning speed counts like a speed in that comparison."""


class PushMotion:
    """One push of a robot, advanced in each physics step.

    Args:
        push: displacement and duration.
        physics: the robot.

    Attributes:
        is_over: whether the body has been moved by all of it, or an obstacle stopped it.
        is_blocked: whether an obstacle stopped it.
    """

    def __init__(self, push: Push, physics: PhysicsRobot) -> None:
        self._push, self._physics = push, physics
        self._begin = physics.truth().pose
        self._elapsed = 0.0
        self._given: tuple[float, float, float] | None = None
        self.is_over, self.is_blocked = False, False
        frame = self._begin.heading if push.frame == "robot" else 0.0
        c, s = cos(frame), sin(frame)
        self._by = (c * push.by.x - s * push.by.y, s * push.by.x + c * push.by.y, push.by.heading)
        physics.slide()

    def advance(self, period: float, drive: Twist) -> None:
        """Set the body's velocity for the next physics step, or end the push.

        Args:
            period: of the physics, seconds.
            drive: velocity of the drive by its wheels, base frame.
        """
        self.is_blocked = self._given is not None and self._is_slow(self._given)
        if self.is_blocked or self._elapsed >= self._push.over - period / 2.0:
            self._end(drive)
            return
        share = self._elapsed / self._push.over + period / (2.0 * self._push.over)
        rate = (1.0 - cos(2.0 * pi * share)) / self._push.over
        self._given = self._with_drive(drive, rate)
        self._physics.set_velocity(*self._given)
        self._elapsed += period

    @property
    def moved(self) -> Pose2D:
        """Displacement of the body since the begin of the push, in its frame at the begin."""
        return self._physics.truth().pose.relative_to(self._begin)

    def _with_drive(self, drive: Twist, rate: float) -> tuple[float, float, float]:
        """Return velocity (x, y) in the world frame and spin of the body, m/s and rad/s."""
        heading = self._physics.truth().pose.heading
        c, s = cos(heading), sin(heading)
        return (
            c * drive.linear - s * drive.lateral + rate * self._by[0],
            s * drive.linear + c * drive.lateral + rate * self._by[1],
            drive.angular + rate * self._by[2],
        )

    def _is_slow(self, given: tuple[float, float, float]) -> bool:
        _, _, _, (vx, vy, _), (_, _, spin) = self._physics.base_state()
        wanted = (given[0], given[1], TURNING_ARM * given[2])
        speed = hypot(*wanted)
        along = wanted[0] * vx + wanted[1] * vy + wanted[2] * TURNING_ARM * spin
        # Below 1 cm/s the contacts of the wheels with the floor matter more than the push.
        return speed > 0.01 and along < BLOCKED * speed * speed

    def _end(self, drive: Twist) -> None:
        rest = (0.0, 0.0, 0.0) if self.is_blocked else self._with_drive(drive, 0.0)
        self._physics.set_velocity(*rest)
        self._physics.grip()
        self.is_over = True
