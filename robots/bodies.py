"""The bodies by name: which one runs is the robot file's or the command line's choice."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stack.body import Body
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import suggestion
from stack.sim.worlds.world import World
from stack.types import Observation, Pose2D

if TYPE_CHECKING:
    from stack.sim.simulation import Simulation


@dataclass(frozen=True)
class BodySetup:
    """What a body is made from.

    Attributes:
        robot: description of the robot.
        world: in which it drives; real and replayed robots have no use for it.
        start: pose of the base, world frame.
        seed: of every random stream.
        pace: simulated seconds per wall second; 0: as fast as possible.
        recording: observations to play.
        after: seconds that a replayed robot stands after its recording.
    """

    robot: RobotDescription
    world: World
    start: Pose2D
    seed: int = 0
    pace: float = 0.0
    recording: Iterable[Observation] = ()
    after: float = 0.0


MakeBody = Callable[[BodySetup], Body]


def simulated(setup: BodySetup) -> Body:
    """Physics, sensors and people in PyBullet."""
    from robots.simulated import SimulatedBody

    body = SimulatedBody(setup.robot, setup.world, start=setup.start, seed=setup.seed)
    body.pace = setup.pace
    return body


def sharing(simulation: Simulation) -> MakeBody:
    """Return a maker of simulated robots in one world, with one clock."""

    def make(setup: BodySetup) -> Body:
        from robots.simulated import SimulatedBody

        return SimulatedBody(
            setup.robot, setup.world, start=setup.start, seed=setup.seed, simulation=simulation
        )

    return make


def scripted(setup: BodySetup) -> Body:
    """Perfect drive and noiseless range sensors in the world, without physics and people."""
    from robots.scripted import ScriptedBody, scans_of

    return ScriptedBody(setup.robot, scans_of(setup.robot, setup.world), start=setup.start)


def replayed(setup: BodySetup) -> Body:
    """Plays a recording; commands have no effect."""
    from robots.replayed import ReplayedBody

    return ReplayedBody(setup.robot, setup.recording, after=setup.after, pace=setup.pace)


BODIES: dict[str, MakeBody] = {"simulated": simulated, "scripted": scripted, "replayed": replayed}
"""Bodies by the name in robot.yaml and `--body`."""


def find_body(name: str) -> MakeBody:
    """Return the maker of a body.

    Raises:
        InputError: there is no body of this name.
    """
    if name not in BODIES:
        raise InputError(f"there is no body {name!r}; {suggestion(name, BODIES)}")
    return BODIES[name]
