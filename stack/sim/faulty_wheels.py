"""Wheels with faults: weak or stuck motors, and wheels that slip on the floor."""

from __future__ import annotations

from collections.abc import Sequence

from stack.sim.physics.engine import PhysicsRobot
from stack.sim.skidding import Rolling


class FaultyWheels(Rolling):
    """Driven wheels of which some turn slower than commanded, or roll less far than they turn.

    Encoders measure how the wheels turn: a weak motor is measured, slip is not.

    Args:
        wheels: without these faults.
        physics: the robot.

    Attributes:
        power: share of the commanded speed, or torque, that each wheel has.
        grip: share of the way that each wheel turns by which it moves the robot, above 0.
    """

    def __init__(self, wheels: Rolling, physics: PhysicsRobot) -> None:
        self._wheels = wheels
        self._physics = list(physics.wheel_angles())
        self._turned = list(self._physics)
        self.power = [1.0] * len(self._turned)
        self.grip = [1.0] * len(self._turned)

    def motor_speeds(self, speeds: Sequence[float]) -> Sequence[float]:
        """Speeds of the wheels in the physics, rad/s."""
        turning = _times(speeds, self.power)
        return _times(self._wheels.motor_speeds(turning), self.grip)

    def encoder_angles(self, angles: Sequence[float]) -> Sequence[float]:
        """Angles that the wheels have turned, radians; integrated over the calls."""
        steps = (now - then for now, then in zip(angles, self._physics, strict=True))
        self._turned = [
            turned + step / grip
            for turned, step, grip in zip(self._turned, steps, self.grip, strict=True)
        ]
        self._physics = list(angles)
        return self._wheels.encoder_angles(self._turned)

    def encoder_speeds(self, speeds: Sequence[float]) -> Sequence[float]:
        """Speeds at which the wheels turn, rad/s."""
        turning = [speed / grip for speed, grip in zip(speeds, self.grip, strict=True)]
        return self._wheels.encoder_speeds(turning)

    def motor_torques(self, torques: Sequence[float]) -> Sequence[float]:
        """Torques on the wheels in the physics, N m."""
        return self._wheels.motor_torques(_times(torques, self.power))

    def update(self, floor: int) -> bool:
        """Update the sliding; return whether it changed."""
        return self._wheels.update(floor)


def _times(values: Sequence[float], shares: Sequence[float]) -> list[float]:
    return [value * share for value, share in zip(values, shares, strict=True)]
