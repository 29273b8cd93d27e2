"""Drives to one goal: rules, worlds, setups, entries, and the rows of their table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from missions.bench.bench import Key, Row
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from stack.errors import InputError
from stack.sim.worlds.world import World
from stack.types import Pose2D

CONTROLLER = "controller.use"
"""Parameter that chooses the controller; it comes first in a label, by its value."""

GOAL = "goal"
"""Name of the goal in a benchmark's mission: an argument, or a place of its world."""


@dataclass(frozen=True, slots=True)
class Rules:
    """Conditions that end a run.

    Attributes:
        goal_radius: goal tolerance for the robot's true position, metres.
        time_limit: seconds on the run's clock.
        by_mission: whether the mission must also succeed; otherwise the position is enough.
    """

    goal_radius: float
    time_limit: float
    by_mission: bool = False


@dataclass(frozen=True, slots=True)
class Case:
    """A world to drive through.

    Attributes:
        name: `17`, `door`, or the stem of its file.
        file: world file, if the mission uses the places of the world.
        path_length: length of the metric's optimal path, metres; None computes the shortest.
    """

    name: str
    world: World
    file: Path | None = None
    path_length: float | None = None


@dataclass(frozen=True)
class Setup:
    """Mission, rules and settings that several runs share.

    Attributes:
        mission: name or path of the mission.
        rules: conditions that end a run.
        options: of the runs: arguments, robot and parameters; the seed is the trial, the world that
            of the case, and images are not rendered.
    """

    mission: str
    rules: Rules
    options: RunOptions = field(default_factory=RunOptions)

    @property
    def label(self) -> str:
        """Unique label among the setups of a table."""
        given = [
            value if name == CONTROLLER else f"{name}={value}"
            for name, value in (self.options.parameters or {}).items()
        ]
        return " ".join(filter(None, (Path(self.mission).stem, self.options.robot, *given)))

    def plan(self, case: Case | None, trial: int) -> tuple[PreparedMission, RunOptions]:
        """Prepare the mission and return it with the options of the run.

        Args:
            case: its world replaces the mission's; None keeps that.
            trial: the seed.

        Raises:
            InputError: the mission has errors.
        """
        file = None if case is None else case.file
        options = replace(
            self.options, seed=trial, serve=False, camera="off",
            world=None if file is None else str(file.resolve()),
        )  # fmt: skip
        plan = prepare(self.mission, options)
        return (plan if case is None else replace(plan, world=case.world)), options


def with_controller(name: str | None, given: Mapping[str, str]) -> dict[str, str]:
    """Return the given parameters after the one that chooses a controller; None chooses none."""
    return {**({CONTROLLER: name} if name else {}), **given}


def goal_of(plan: PreparedMission) -> Pose2D:
    """Return the goal of a benchmark's mission: its argument `goal`, else the place `goal`.

    Raises:
        InputError: the mission has neither.
    """
    named = {**plan.world.places, **plan.mission.places, **plan.mission.arguments}
    goal = named.get(GOAL)
    if not isinstance(goal, Pose2D):
        source = plan.mission.source.name
        raise InputError(f"{source}: a benchmark's mission needs an argument `goal` of type Pose")
    return goal


@dataclass(frozen=True, slots=True)
class Entry:
    """One run to make; trial n has seed n."""

    setup: Setup
    case: Case
    trial: int

    @property
    def key(self) -> Key:
        """Unique key of the run in a table."""
        return self.setup.label, self.case.name, self.trial

    @property
    def label(self) -> str:
        """Label of the setup."""
        return self.setup.label


@dataclass(frozen=True, slots=True)
class TrialRow(Row):
    """One row of the table: a run.

    Attributes:
        setup: label of its setup.
        status: success | contact | struck (while it stood still) | timeout | gave_up | crashed.
        cause: why it failed, in a sentence; empty after a success.
        time: seconds on the run's clock. path_length: length of the optimal path, metres.
        driven: metres. clearance: smallest true distance to any obstacle, metres.
        end: final x, y (metres) and heading (radians).
        wall_seconds: compute time.
    """

    setup: str
    world: str
    trial: int
    status: str
    cause: str
    time: float = 0.0
    path_length: float = 0.0
    driven: float = 0.0
    clearance: float = 0.0
    recoveries: int = 0
    replans: int = 0
    end: tuple[float, ...] = (0.0, 0.0, 0.0)
    wall_seconds: float = 0.0

    @property
    def title(self) -> str:
        """Which run it was; the parameters of its setup are in settings.json."""
        setup = " ".join(word for word in self.setup.split() if "=" not in word)
        return f"{setup}, {self.world} trial {self.trial}"

    @property
    def figures(self) -> str:
        """Its most important figures as text."""
        return f"{self.time:.1f} s, {self.driven:.1f} m, clearance {self.clearance:.2f} m"
