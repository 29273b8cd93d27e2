"""What a benchmark runs and what comes of it: cases, setups, rules, and rows of a table."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from missions.execution.prepare import PreparedMission, RunOptions, prepare
from stack.errors import InputError
from stack.sim.worlds.world import World
from stack.types import Pose2D

GOAL = "goal"
"""What a benchmark's mission calls the pose to reach: an argument, or a place of its world."""


@dataclass(frozen=True, slots=True)
class Rules:
    """When a run is over, and how.

    Attributes:
        goal_radius: metres from the goal within which the robot's true position is there.
        time_limit: seconds on the run's clock.
        by_mission: whether the mission must say that it is there; else the radius is enough.
    """

    goal_radius: float
    time_limit: float
    by_mission: bool = False


@dataclass(frozen=True, slots=True)
class Case:
    """A world to drive through.

    Attributes:
        name: `17`, `door`, or the stem of its file.
        file: of the world, when the mission is to be read with it for the sake of its places.
        path_length: metres of the way that a metric calls optimal; None for the shortest one.
    """

    name: str
    world: World
    file: Path | None = None
    path_length: float | None = None


@dataclass(frozen=True)
class Setup:
    """What several runs of a benchmark share.

    Attributes:
        mission: name or path.
        rules: when its runs are over.
        arguments: as `--set` gives them.
        robot: in place of the mission's.
        controller: in place of the mission's, with its own defaults.
        parameters: `controller.cruise_speed` -> value as text, over everything in files.
    """

    mission: str
    rules: Rules
    arguments: dict[str, str] = field(default_factory=dict)
    robot: str | None = None
    controller: str | None = None
    parameters: dict[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Names it among the setups of one table."""
        given = [f"{name}={value}" for name, value in self.parameters.items()]
        stem = Path(self.mission).stem
        return " ".join(filter(None, (stem, self.robot, self.controller, *given)))

    def plan(self, case: Case | None, trial: int) -> tuple[PreparedMission, RunOptions]:
        """The mission, read and checked, and how it is run.

        Args:
            case: its world takes the place of the mission's; None leaves that.
            trial: the seed.

        Raises:
            InputError: the mission is wrong.
        """
        file = None if case is None else case.file
        options = RunOptions(
            seed=trial, arguments=self.arguments, robot=self.robot, serve=False, camera="off",
            world=None if file is None else str(file.resolve()),
            parameters=({"controller.use": self.controller} if self.controller else {})
            | self.parameters,
        )  # fmt: skip
        plan = prepare(self.mission, options)
        return (plan if case is None else replace(plan, world=case.world)), options


def goal_of(plan: PreparedMission) -> Pose2D:
    """Where a benchmark's mission leads: its argument `goal`, else the place of that name.

    Raises:
        InputError: it has neither.
    """
    named = {**plan.world.places, **plan.mission.places, **plan.mission.arguments}
    goal = named.get(GOAL)
    if not isinstance(goal, Pose2D):
        source = plan.mission.source.name
        raise InputError(f"{source}: a benchmark's mission needs the argument goal, a Pose")
    return goal


@dataclass(frozen=True, slots=True)
class Entry:
    """One run to make: trial n has seed n."""

    setup: Setup
    case: Case
    trial: int

    @property
    def key(self) -> tuple[str, str, int]:
        """Names it among all runs of a table."""
        return self.setup.label, self.case.name, self.trial


@dataclass(frozen=True, slots=True)
class Run:
    """One run, as it stands in the table.

    Attributes:
        setup: label of its setup.
        status: success | contact | struck (while it stood) | timeout | gave_up.
        cause: why it failed, in a sentence; empty after a success.
        time: seconds on its clock. path_length: of the optimal path, metres.
        driven: metres. clearance: smallest true distance to anything, metres.
        end: x, y, heading where it ended.
        wall_seconds: compute time.
    """

    setup: str
    world: str
    trial: int
    status: str
    cause: str
    time: float
    path_length: float
    driven: float
    clearance: float
    recoveries: int
    replans: int
    end: tuple[float, float, float]
    wall_seconds: float

    @property
    def success(self) -> bool:
        """Whether it counts."""
        return self.status == "success"

    @property
    def key(self) -> tuple[str, str, int]:
        """That of its entry."""
        return self.setup, self.world, self.trial
