"""Experiments: in which worlds the robot drives, what happens to it, and when a run has passed."""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import degrees, pi, radians
from pathlib import Path

from missions.bench.bench import Key, Options
from missions.bench.generation.floor_plan import FloorPlan
from missions.bench.generation.worlds import WorldOptions, generate
from stack.errors import InputError
from stack.streams import stream
from stack.types import Pose2D
from tests.benchmarks.benchmark import FILES

PATROL = FILES / "patrol.yaml"
UNKNOWN_START = FILES / "unknown_start.yaml"

EVENT_TIME = 8.0
"""Seconds after which the robot is pushed or kidnapped, on the run's clock."""

PUSH_DISTANCE, PUSH_TURN, PUSH_SPEED = (0.1, 2.0), radians(60.0), 1.0
"""Metres, radians to both sides, and mean speed in m/s of the pushes."""

GOALS = 12
"""Goals in random rooms, repeated."""


@dataclass(frozen=True)
class Experiment:
    """One row of the table.

    Attributes:
        kinds: kinds of worlds, used in turn by the seeds.
        seconds: length of a run on its clock.
        event: `push`, `kidnap`, `unknown` (start), or empty.
        people: in the world. unmapped: share of the furniture that the map does not show.
    """

    name: str
    kinds: tuple[str, ...]
    seconds: float
    event: str = ""
    people: int = 0
    unmapped: float = 0.0


FEATURES = ("flat", "office", "warehouse")
EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        Experiment("office", ("office",), 90.0),
        Experiment("warehouse", ("warehouse",), 90.0),
        Experiment("flat", ("flat",), 90.0, unmapped=0.3),
        Experiment("crowded", ("flat",), 90.0, people=6, unmapped=0.6),
        Experiment("corridor", ("corridor",), 120.0),
        Experiment("pushed", FEATURES, 30.0, "push"),
        Experiment("kidnapped", FEATURES, 40.0, "kidnap"),
        Experiment("unknown", FEATURES, 60.0, "unknown"),
        Experiment("hotel", ("hotel",), 120.0, "unknown"),
        Experiment("twin", ("twin",), 60.0, "unknown"),
        Experiment("people", ("flat",), 300.0, people=4, unmapped=0.3),
    )
}
"""By name, in the order of the table. `twin` has no difference that could be driven to."""


@dataclass(frozen=True)
class LocalisationEntry:
    """One run to make.

    Attributes:
        experiment: name of the experiment. seed: of world, event and run.
        options: of the bench.
    """

    experiment: str
    seed: int
    options: Options

    @property
    def kind(self) -> str:
        """Kind of the world."""
        kinds = EXPERIMENTS[self.experiment].kinds
        return kinds[self.seed % len(kinds)]

    @property
    def key(self) -> Key:
        """Unique key of the run in a table."""
        return self.experiment, self.kind, self.seed

    @property
    def label(self) -> str:
        """Name of the experiment."""
        return self.experiment


@dataclass(frozen=True)
class Case:
    """The world of a run as a file, and the goals.

    Attributes:
        file: world file with the event in its timeline.
        goals: value of the mission's argument, as text.
        mission: mission file.
    """

    file: Path
    goals: str
    mission: Path

    def command(self, seed: int) -> str:
        """Return the command line that runs this case alone."""
        options = f"--world {self.file} --seed {seed} --set 'goals={self.goals}'"
        return f"treepilot run {self.mission} {options}"


def entries_of(options: Options) -> list[LocalisationEntry]:
    """Return the runs of some experiments, seed by seed, so that an interrupted bench has all.

    Raises:
        InputError: there is no such experiment.
    """
    for name in options.names:
        if name not in EXPERIMENTS:
            raise InputError(f"no experiment {name!r}; choose from {', '.join(EXPERIMENTS)}")
    return [
        LocalisationEntry(name, seed, options)
        for seed in options.seeds
        for name in options.names or tuple(EXPERIMENTS)
    ]


def make_case(entry: LocalisationEntry) -> Case:
    """Generate the world of a run, write its file, and choose the goals."""
    experiment = EXPERIMENTS[entry.experiment]
    plan = generate(
        WorldOptions(entry.kind, entry.seed, people=experiment.people, unmapped=experiment.unmapped)
    )
    random = stream(entry.seed, f"localisation {entry.experiment}")
    names = [str(name) for name in random.permutation(list(plan.places))]
    start, *others = names
    plan.keep_clear(plan.places[start])
    others = (others or [start]) * GOALS
    text = plan.text(start) + _timeline(entry, plan, others[0])
    folder = entry.options.worlds
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{entry.experiment}_{entry.kind}_{entry.seed}.yaml"
    if not file.exists() or file.read_text("utf-8") != text:
        file.write_text(text, "utf-8")
    poses = [plan.places[name] for name in others[:GOALS]]
    goals = [[pose.x, pose.y, pose.heading] for pose in poses]
    mission = UNKNOWN_START if experiment.event == "unknown" else PATROL
    return Case(file.resolve(), json.dumps(goals), mission)


def push_of(entry: LocalisationEntry) -> tuple[Pose2D, float]:
    """Return displacement in the base frame and duration, seconds, of the push of a run."""
    random = stream(entry.seed, "localisation push")
    distance, direction = random.uniform(*PUSH_DISTANCE), random.uniform(-pi, pi)
    turn = random.uniform(-PUSH_TURN, PUSH_TURN)
    step = Pose2D(0.0, 0.0, direction).compose(Pose2D(distance, 0.0))
    by = Pose2D(round(step.x, 3), round(step.y, 3), round(turn, 3))
    return by, round(0.3 + distance / PUSH_SPEED, 2)


def _timeline(entry: LocalisationEntry, plan: FloorPlan, first_goal: str) -> str:
    """Return the event of a run as the timeline of its world file."""
    event = EXPERIMENTS[entry.experiment].event
    if event == "push":
        by, over = push_of(entry)
        action = f"push: {{by: [{by.x}, {by.y}, {degrees(by.heading):.2f} deg], over: {over}}}"
    elif event == "kidnap":
        at = _far_place(entry, plan, plan.places[first_goal])
        action = f"move_robot: [{at.x}, {at.y}, {degrees(at.heading):.2f} deg]"
    else:
        return ""
    return f"timeline:\n  - {{when: {{time: {EVENT_TIME}}}, {action}}}\n"


def _far_place(entry: LocalisationEntry, plan: FloorPlan, goal: Pose2D) -> Pose2D:
    """Return a place at least 2 m from the first goal, turned at random."""
    random = stream(entry.seed, "localisation kidnap")
    places = [at for at in plan.places.values() if at.distance_to(goal) > 2.0]
    at = (places or list(plan.places.values()))[int(random.integers(max(1, len(places))))]
    return Pose2D(at.x, at.y, round(float(random.uniform(-pi, pi)), 3))
