"""Robot that is carried elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import FARTHEST, parameter
from stack.sim.faults.fault import NOW, Fault, Target, outside
from stack.sim.faults.room import free_places
from stack.sim.worlds.world import World
from stack.types import LiftedRobot, Pose2D


@dataclass(frozen=True)
class KidnapParameters:
    """Parameters of `Kidnap`."""

    to: Pose2D | None = parameter(
        None, "m", help="where it is put down; default: a free place at `distance`", public=True
    )
    distance: float = parameter(
        2.0, "m", above=0.0, at_most=FARTHEST, public=True,
        help="to a random free place that far away; without any, to one nearer",
    )  # fmt: skip


class Kidnap(Fault):
    """Somebody carries the robot elsewhere; its odometry does not notice."""

    Parameters = KidnapParameters
    kind = NOW

    @classmethod
    def lack(cls, parameters: KidnapParameters, robot: RobotDescription, world: World) -> str:
        """Return that the place is not in the world."""
        to = parameters.to
        return "" if to is None else outside(world, to.x, to.y)

    def begin(self, target: Target) -> None:
        """Put the robot down."""
        target.disturb(LiftedRobot(self.parameters.to or self._drawn(target)))

    def _drawn(self, target: Target) -> Pose2D:
        distance = self.parameters.distance
        for away in np.arange(distance, 0.3, -0.1).tolist():
            places = free_places(target.simulation, target.robot, away)
            if len(places):
                x, y = places[self.random.integers(len(places))].tolist()
                return Pose2D(x, y, float(self.random.uniform(-pi, pi)))
        raise InputError(f"no free place within {distance:g} m")
