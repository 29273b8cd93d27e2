"""The kinds of bodies: which one runs is the robot file's or the command line's choice.

A plugin registers a class that inherits `BodyKind` in the entry-point group `treepilot.bodies`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from robots.mavlink.parameters import MavlinkParameters
from robots.motors.parameters import WheelsParameters
from stack.body import Body
from stack.drivetrain.description import RobotDescription
from stack.fast_loop.driver import Lack, driver_class
from stack.parameters import build
from stack.plugins import named_class
from stack.sim.faults.planned import PlannedFault
from stack.sim.worlds.world import World
from stack.types import Observation, Pose2D

if TYPE_CHECKING:
    from stack.sim.simulation import Simulation

GROUP = "treepilot.bodies"


@dataclass(frozen=True)
class BodySetup:
    """What a body is made from.

    Attributes:
        robot: description of the robot.
        world: in which it drives; real robots have no use for it.
        start: pose of the base, world frame.
        seed: of every random stream.
        pace: simulated seconds per wall second; 0: as fast as possible.
        tell: writes a line to the log and for people.
        interrupted: whether the user has given up waiting for the robot.
        faults: that befall a simulated robot.
    """

    robot: RobotDescription
    world: World
    start: Pose2D
    seed: int = 0
    pace: float = 0.0
    tell: Callable[[str], None] = lambda line: None
    interrupted: Callable[[], bool] = lambda: False
    faults: tuple[PlannedFault, ...] = ()


MakeBody = Callable[[BodySetup], Body]


@dataclass(frozen=True)
class NoParameters:
    """Parameters of a body that has none."""


class BodyKind(ABC):
    """A kind of body. Its module must not import what only `make` needs.

    Attributes:
        Parameters: a frozen dataclass of `parameter(...)` fields: `body: {use: NAME, …}`.
        simulates: whether the body is in a `Simulation`, which several robots can share.
    """

    Parameters: ClassVar[type] = NoParameters
    simulates: ClassVar[bool] = False

    @staticmethod
    def lack(parameters: Any) -> Lack | None:
        """Return what this machine lacks for the body, without touching hardware."""
        return None

    @staticmethod
    @abstractmethod
    def make(setup: BodySetup, parameters: Any) -> Body:
        """Make the body.

        Args:
            setup: of the run.
            parameters: instance of `Parameters`.

        Raises:
            BodyError: the robot cannot be reached.
        """


class Simulated(BodyKind):
    """Physics, sensors and people."""

    simulates = True

    @staticmethod
    def make(setup: BodySetup, parameters: NoParameters) -> Body:
        """Make the body, with a simulation of its own."""
        from robots.simulated import SimulatedBody

        body = SimulatedBody(
            setup.robot, setup.world, start=setup.start, seed=setup.seed, faults=setup.faults
        )
        body.pace = setup.pace
        return body


class Scripted(BodyKind):
    """Perfect drive and noiseless range sensors in the world, without physics and people."""

    @staticmethod
    def make(setup: BodySetup, parameters: NoParameters) -> Body:
        """Make the body, with a script of its range sensors."""
        from robots.scripted import ScriptedBody, scans_of

        return ScriptedBody(setup.robot, scans_of(setup.robot, setup.world), start=setup.start)


class Wheels(BodyKind):
    """Motors of the robot's own, or emulated ones, held by a fast loop."""

    Parameters = WheelsParameters

    @staticmethod
    def lack(parameters: WheelsParameters) -> Lack | None:
        """Return what this machine lacks for the driver."""
        name, values = parameters.named_driver
        driver = driver_class(name)
        return driver.lack(build(driver.Parameters, values))

    @staticmethod
    def make(setup: BodySetup, parameters: WheelsParameters) -> Body:
        """Make the body, with a process of the fast loop; the wheels have torque from now on."""
        from robots.motors.body import WheelsBody

        return WheelsBody(setup.robot, parameters)


class Mavlink(BodyKind):
    """A rover behind MAVLink: ArduRover in GUIDED, PX4 in OFFBOARD."""

    Parameters = MavlinkParameters

    @staticmethod
    def make(setup: BodySetup, parameters: MavlinkParameters) -> Body:
        """Connect, check, arm and set the mode."""
        from robots.mavlink.body import MavlinkBody

        return MavlinkBody(
            setup.robot, parameters, start=setup.start, tell=setup.tell,
            interrupted=setup.interrupted,
        )  # fmt: skip


BUILT_IN = {
    "simulated": "robots.bodies:Simulated",
    "scripted": "robots.bodies:Scripted",
    "mavlink": "robots.bodies:Mavlink",
    "wheels": "robots.bodies:Wheels",
}


def body_kind(name: str) -> type[BodyKind]:
    """Return a kind of body, a built-in one or a plugin's.

    Raises:
        InputError: there is none of this name, or the plugin cannot be used.
    """
    return named_class("body", name, GROUP, BUILT_IN, BodyKind)  # type: ignore[type-abstract]


def find_body(name: str, values: Mapping[str, Any]) -> MakeBody:
    """Return the maker of a body with parameters.

    Raises:
        InputError: there is no body of this name.
        ParameterError: a parameter is unknown or its value is wrong.
    """
    kind = body_kind(name)
    parameters: Any = build(kind.Parameters, dict(values))
    return lambda setup: kind.make(setup, parameters)


def lack_of(robot: RobotDescription, choice: str) -> Lack | None:
    """Return what this machine lacks for the body that is chosen; as `chosen_body`."""
    kind = body_kind(choice or robot.body)
    values = robot.body_parameters if kind is body_kind(robot.body) else {}
    return kind.lack(build(kind.Parameters, dict(values)))


def chosen_body(robot: RobotDescription, choice: str) -> MakeBody:
    """Return the maker of the body that a robot file chooses, or a command line.

    Args:
        robot: with its choice and the parameters of that.
        choice: of the command line; empty: the robot's.

    Raises:
        InputError: there is no body of this name.
    """
    name = choice or robot.body
    return find_body(name, robot.body_parameters if name == robot.body else {})


def sharing(simulation: Simulation) -> MakeBody:
    """Return a maker of simulated robots in one world, with one clock."""

    def make(setup: BodySetup) -> Body:
        from robots.simulated import SimulatedBody

        return SimulatedBody(
            setup.robot, setup.world, start=setup.start, seed=setup.seed, simulation=simulation,
            faults=setup.faults,
        )  # fmt: skip

    return make


def playing(recording: Iterable[Observation], after: float = 0.0) -> MakeBody:
    """Return a maker of a body that plays a recording; commands have no effect.

    Args:
        recording: observations in order.
        after: seconds that the robot stands after its recording.
    """

    def make(setup: BodySetup) -> Body:
        from robots.replayed import ReplayedBody

        return ReplayedBody(setup.robot, recording, after=after, pace=setup.pace)

    return make
