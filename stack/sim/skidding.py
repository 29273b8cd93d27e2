"""Skidding of wheels in turns: between the wheels that roll and the physics of the base.

Four fixed wheels that skid work against each other in rigid-body contacts, and the robot hops. The
physics therefore carries a skid-steered robot on the two wheels of one axle, which roll exactly.
This module converts between both: the base moves with the instantaneous centres of rotation of the
real wheels (stack.drivetrain.skid_steered), and the encoders report the real wheels. These centres
lie on the line of the axle in the URDF.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, sqrt

from stack.drivetrain.description import RobotDescription
from stack.sim.physics.engine import PhysicsRobot
from stack.streams import stream


class Rolling:
    """Wheels that roll without skidding: physics and encoders see the same wheels."""

    def motor_speeds(self, speeds: Sequence[float]) -> Sequence[float]:
        """Speeds of the wheels in the physics from those of the real wheels, rad/s."""
        return speeds

    def encoder_angles(self, angles: Sequence[float]) -> Sequence[float]:
        """Angles of the real wheels from those in the physics, radians."""
        return angles

    def encoder_speeds(self, speeds: Sequence[float]) -> Sequence[float]:
        """Speeds of the real wheels from those in the physics, rad/s."""
        return speeds

    def motor_torques(self, torques: Sequence[float]) -> Sequence[float]:
        """Torques on the wheels in the physics from those on the real wheels, N m."""
        return torques

    def update(self, floor: int) -> bool:
        """Update the sliding on a floor (number of the friction zone); return if it changed."""
        return False


class Skidding(Rolling):
    """Left and right wheels that slide about centres of rotation outside the wheels.

    The distance between these centres differs between floors and varies along the way: a
    first-order Gauss-Markov process over the distance that the wheels roll.

    Args:
        robot: gives the calibrated drivetrain and the parameters of the sliding.
        axle: distance between the wheels in the physics, metres.
        seed: of the random streams.

    Attributes:
        track: current distance between the centres of rotation, metres.
    """

    def __init__(self, robot: RobotDescription, axle: float, seed: int) -> None:
        self._drivetrain, self._skid, self._axle = robot.drivetrain, robot.skid, axle
        self._radius, self._seed = robot.wheels.radius, seed
        self._random = stream(seed, "skid")
        self._variation = float(self._random.standard_normal())
        self._floors: dict[int, float] = {}
        self._physics: list[float] = []
        self._angles: list[float] = []
        self._rolled = 0.0
        self.track = self._track_on(0)

    def motor_speeds(self, speeds: Sequence[float]) -> Sequence[float]:
        """Speeds of the wheels of the axle, rad/s."""
        return _about_mean(speeds, self._axle / self.track)

    def encoder_angles(self, angles: Sequence[float]) -> Sequence[float]:
        """Angles of the real wheels, radians; integrated over the calls."""
        if not self._physics:
            self._physics, self._angles = list(angles), [0.0] * len(angles)
        steps = [now - then for now, then in zip(angles, self._physics, strict=True)]
        rolled = _about_mean(steps, self.track / self._axle)
        self._physics = list(angles)
        self._angles = [angle + step for angle, step in zip(self._angles, rolled, strict=True)]
        self._rolled += self._radius * sum(map(abs, rolled)) / len(rolled)
        return self._angles

    def encoder_speeds(self, speeds: Sequence[float]) -> Sequence[float]:
        """Speeds of the real wheels, rad/s."""
        return _about_mean(speeds, self.track / self._axle)

    def motor_torques(self, torques: Sequence[float]) -> Sequence[float]:
        """Torques on the wheels of the axle, N m, with the power of those on the real wheels."""
        return _about_mean(torques, self.track / self._axle)

    def update(self, floor: int) -> bool:
        """Draw the distance between the centres for the way rolled since the last call."""
        keep = exp(-self._rolled / self._skid.variation_length)
        # One draw even at standstill: the random stream depends on time alone.
        draw = float(self._random.standard_normal())
        self._variation = keep * self._variation + sqrt(1.0 - keep * keep) * draw
        self._rolled, before = 0.0, self.track
        self.track = self._track_on(floor)
        return self.track != before

    def _track_on(self, floor: int) -> float:
        skid, calibrated = self._skid, self._drivetrain.effective_track
        if floor not in self._floors:
            draw = float(stream(self._seed, "skid floor", floor).standard_normal())
            self._floors[floor] = draw
        relative = skid.floor_variation * self._floors[floor] + skid.variation * self._variation
        # The centres of rotation are never between the wheels.
        ratio = max(1.0, skid.icr_ratio * (1.0 + relative))
        return calibrated + skid.slip * (ratio * self._drivetrain.track - calibrated)


def wheel_motion_of(robot: RobotDescription, physics: PhysicsRobot, seed: int) -> Rolling:
    """Return how the wheels of a robot move on the floor."""
    if not robot.drivetrain.skids:
        return Rolling()
    sides = physics.wheel_places[: len(robot.drivetrain.driven_joints), 1]
    return Skidding(robot, float(sides.max() - sides.min()), seed)


def _about_mean(values: Sequence[float], factor: float) -> list[float]:
    """Scale the differences of values from their mean."""
    mean = sum(values) / len(values)
    return [mean + factor * (value - mean) for value in values]
