"""Base class of the kinds of faults: what they need, and where they act."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.sim.worlds.world import World
from stack.types import Disturbance, Measurement, Pose2D

if TYPE_CHECKING:  # `treepilot check` reads faults and imports no simulation
    from stack.sim.simulated_robot import SimulatedRobot
    from stack.sim.simulation import Simulation

Measurements = dict[str, Measurement]
"""New measurements of a step by sensor name."""

NOW, LASTING, BEFORE = "now", "lasting", "before"
"""A fault happens in one moment, lasts, or is there before the run begins."""


@dataclass(frozen=True, slots=True)
class Target:
    """What a fault befalls.

    Attributes:
        simulation: with the robot.
        robot: that it befalls.
        disturb: does what operators can do to them, too.
    """

    simulation: Simulation
    robot: SimulatedRobot
    disturb: Callable[[Disturbance], None]


def outside(world: World, x: float, y: float, reach: float = 0.0) -> str:
    """Return that a point, world frame, is farther than `reach` from the world; empty: it is not.

    All in metres.
    """
    x_min, y_min, x_max, y_max = world.bounds
    if x_min - reach <= x <= x_max + reach and y_min - reach <= y <= y_max + reach:
        return ""
    return (
        f"({x:g}, {y:g}) is outside the world, which covers x {x_min:g} to {x_max:g} m"
        f" and y {y_min:g} to {y_max:g} m"
    )


class Fault:
    """One occurrence of a fault. A kind is a subclass in a module of its name in `kinds`.

    It acts on the simulated body, between two steps; the stack learns of it by its sensors only.

    Args:
        parameters: of the kind.
        random: stream of this occurrence.

    Attributes:
        Parameters: a frozen dataclass of `parameter(...)` fields, all with defaults.
        kind: now | lasting | before.
        settings: live parameters of the stack that it changes while it lasts, by full name: for
            what a simulation cannot slow down, because its results are due at fixed times.
    """

    Parameters: ClassVar[type]
    kind: ClassVar[str] = LASTING

    def __init__(self, parameters: Any, random: np.random.Generator) -> None:
        self.parameters, self.random = parameters, random

    @classmethod
    def lack(cls, parameters: Any, robot: RobotDescription, world: World) -> str:
        """Return what robot or world lack for it, as a sentence; empty: nothing."""
        return ""

    @property
    def settings(self) -> Mapping[str, float]:
        """Live parameters of the stack while it lasts."""
        return {}

    def begin(self, target: Target) -> None:
        """Begin.

        Raises:
            InputError: it is not possible now, e.g. for want of room.
        """

    def end(self, target: Target) -> None:
        """End."""

    def measured(self, measurements: Measurements, time: float) -> Measurements:
        """Return what the sensors deliver instead; called in each step."""
        return measurements

    def changed_world(self, world: World, robot: RobotDescription, start: Pose2D) -> World:
        """Return the world in which the robot drives, other than its map; of the kind `before`."""
        return world
