"""Random flats and offices with people: worlds, goals, and one run of `treepilot bench flats`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from missions.bench.drive_recorder import DriveRecorder
from missions.bench.generation.floor_plan import FloorPlan
from missions.bench.generation.worlds import WorldOptions, generate
from missions.bench.resumable import Key, Work
from missions.bench.runs import CRASHED
from missions.execution.prepare import prepare
from missions.execution.resources import MISSIONS
from missions.execution.run import execute
from missions.run_options import RunOptions
from stack.errors import InputError
from stack.streams import stream
from stack.telemetry.records import Event, RunInfo, Snapshot

MISSION = MISSIONS / "bench" / "flats.yaml"

MODELS = ("none", "social_force", "polite", "unaware")
"""What the people are: nobody; by social forces; on loops, and stop for a robot ahead; on loops,
and react to nobody."""

GOALS = 4
MOST_PEOPLE = 6
UNMAPPED = 0.2
"""Share of the furniture that the map does not show."""

START_CLEARANCE = 1.5
"""Metres between the robot and everybody at the start."""

FALSE_GOAL = 0.5
"""Metres from a goal reported as reached, beyond which the report is false."""

TIME_LIMIT = 900.0
"""Seconds after which a run ends."""

PASSED, FAILED = "passed", "failed"

NOBODY: dict[str, Any] = {
    "contacts": [], "least_distance": None, "seconds_intimate": 0.0, "seconds_personal": 0.0,
    "least_time_to_collision": None, "standoffs": 0, "longest_stand": 0.0,
}  # fmt: skip
"""Measures of a run without people."""


@dataclass(frozen=True)
class FlatEntry:
    """One run to make.

    Attributes:
        robot: name or file. people: one of MODELS. seed: of world, people, goals and run.
        folder: of the generated world files.
        parameters: `controller.cruise_speed` -> value as text.
        keep: folder for the records of the run; None keeps none.
    """

    robot: str
    people: str
    seed: int
    folder: Path
    parameters: Mapping[str, str]
    keep: Path | None = None

    @property
    def key(self) -> Key:
        """Unique key of the run in a table."""
        return Path(self.robot).stem, self.people, self.seed


@dataclass(frozen=True)
class FlatCase:
    """The world of a run as a file, its goals as text, and the number of its people."""

    file: Path
    goals: str
    people: int

    def command(self, robot: str, seed: int) -> str:
        """Return the command line that runs this case alone."""
        options = f"--world {self.file} --robot {robot} --seed {seed} --set 'goals={self.goals}'"
        return f"treepilot run {MISSION} {options}"


@dataclass(frozen=True, slots=True)
class FlatRow:
    """One row of the table: a run.

    Attributes:
        status: passed (all goals reached) | failed | crashed. cause: why it failed.
        visited: number of goals reached. false_goals: goals reported as reached that were not.
        persons: people in the world.
        time: seconds on the run's clock. driven: metres.
        failures: number of failed drives by their code.
        drove_into: contacts with people into which the robot drove. struck_moving, struck_standing:
            those in which somebody walked into it, while it moved and while it stood.
        things: contacts with things.
        least_distance: to somebody, metres; None without people. intimate, personal: seconds in
            Hall's zones.
        collision_time: smallest time to collision, seconds; None: never below 10.
        jerk: root mean square, m/s³. longest_stand: seconds. standoffs: of more than 20 s.
    """

    robot: str
    people: str
    seed: int
    status: str
    cause: str
    visited: int
    false_goals: int
    persons: int
    time: float
    driven: float
    failures: dict[str, int]
    drove_into: int
    struck_moving: int
    struck_standing: int
    things: int
    least_distance: float | None
    intimate: float
    personal: float
    collision_time: float | None
    jerk: float
    longest_stand: float
    standoffs: int
    wall_seconds: float

    @property
    def success(self) -> bool:
        """Whether all goals were reached."""
        return self.status == PASSED

    @property
    def key(self) -> Key:
        """Key of its entry."""
        return self.robot, self.people, self.seed


class FailureCodes:
    """A telemetry sink that counts the failed drives by their code, and contacts with things."""

    def __init__(self) -> None:
        self.codes: Counter[str] = Counter()
        self.things = 0
        self.last = ""

    def open(self, info: RunInfo) -> None:
        """Do nothing."""

    def event(self, event: Event) -> None:
        """Count an event."""
        if event.kind == "task" and event.fields.get("status") == "failed":
            self.codes[str(event.fields.get("code"))] += 1
            self.last = event.text
        elif event.kind == "contact" and "person" not in event.text:
            self.things += 1

    def wants_snapshot(self, time: float) -> bool:
        """Return False: no snapshot is needed."""
        return False

    def snapshot(self, snapshot: Snapshot) -> None:
        """Ignore the final snapshot, which every sink receives."""

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Do nothing."""


def make_case(entry: FlatEntry) -> FlatCase:
    """Generate the world of a run, write its file, and choose start and goals.

    The walls, the furniture, the people and the goals of a seed are the same for all robots and all
    kinds of people; nobody is near the start.

    Raises:
        InputError: there is no such kind of people.
    """
    if entry.people not in MODELS:
        raise InputError(f"no people {entry.people!r}; choose from {', '.join(MODELS)}")
    random = stream(entry.seed, "flats")
    count = int(random.integers(1, MOST_PEOPLE + 1))
    kind = "flat" if entry.seed % 2 == 0 else "office"
    plan = generate(WorldOptions(kind, entry.seed, people=count, unmapped=UNMAPPED))
    names = [str(name) for name in random.permutation(list(plan.places))]
    start, *others = names
    goals = [plan.places[(others or [start])[n % max(1, len(others))]] for n in range(GOALS)]
    _choose_people(plan, entry.people, start)
    first = json.dumps(next(iter(plan.places)))
    text = plan.text().replace(f"start: {first}", f"start: {start}")
    entry.folder.mkdir(parents=True, exist_ok=True)
    file = entry.folder / f"{kind}_{entry.seed}_{entry.people}.yaml"
    if not file.exists() or file.read_text("utf-8") != text:
        file.write_text(text, "utf-8")
    poses = [[pose.x, pose.y, pose.heading] for pose in goals]
    return FlatCase(file.resolve(), json.dumps(poses), len(plan.people))


def _choose_people(plan: FloorPlan, model: str, start: str) -> None:
    """Give the people of a plan their model, and move who is near the start along their way."""
    if model == "none":
        plan.people.clear()
    at = plan.places[start]
    for person in plan.people:
        if model == "social_force":
            person["model"] = "social_force"
        else:
            person["yields"] = model == "polite"
        way = np.array(person["waypoints"], dtype=np.float64)
        away = np.hypot(way[:, 0] - at.x, way[:, 1] - at.y)
        number = int(person["start"] * len(way))
        if min(away[number], away[(number + 1) % len(way)]) < START_CLEARANCE:
            person["start"] = round(int(np.argmax(away)) / len(way) + 0.001, 3)


def options_of(entry: FlatEntry, case: FlatCase) -> RunOptions:
    """Return the options of a run."""
    records = None if entry.keep is None else entry.keep / "-".join(map(str, entry.key))
    return RunOptions(
        seed=entry.seed, robot=entry.robot, arguments={"goals": case.goals}, world=str(case.file),
        out=records,
        serve=False, camera="off", parameters=dict(entry.parameters),
    )  # fmt: skip


def run_flat(entry: FlatEntry) -> FlatRow:
    """Make one run.

    Raises:
        InputError: the mission or a parameter has errors.
    """
    began = perf_counter()
    case = make_case(entry)
    options = options_of(entry, case)
    plan = prepare(MISSION, options)
    recorder, codes = DriveRecorder(), FailureCodes()
    report = execute(plan, options, [recorder, codes], lambda: recorder.time >= TIME_LIMIT)
    false = sum(goal.distance_to(truth) > FALSE_GOAL for goal, truth in recorder.reached)
    visited = int(report.blackboard.get("visited", "0"))
    people = report.people or NOBODY
    by = Counter(item["by"] for item in people["contacts"])
    whole = visited == GOALS and not false
    return FlatRow(
        *entry.key, status=PASSED if whole else FAILED,
        cause="" if whole else (f"{false} false goals" if false else codes.last or report.status),
        visited=visited, false_goals=false, persons=case.people,
        time=round(report.simulated_seconds, 2), driven=round(report.distance_m, 2),
        failures=dict(codes.codes), drove_into=by["robot"],
        struck_moving=by["person, robot moving"], struck_standing=by["person, robot standing"],
        things=codes.things, least_distance=people["least_distance"],
        intimate=people["seconds_intimate"], personal=people["seconds_personal"],
        collision_time=people["least_time_to_collision"], jerk=round(recorder.jerk, 3),
        longest_stand=people["longest_stand"], standoffs=people["standoffs"],
        wall_seconds=round(perf_counter() - began, 2),
    )  # fmt: skip


def line_of(row: FlatRow) -> str:
    """Return a run as one line."""
    figures = f"{row.time:.0f} s, {row.driven:.0f} m"
    if row.drove_into or row.struck_moving or row.struck_standing:
        struck = row.struck_moving + row.struck_standing
        figures += f", drove into {row.drove_into}, struck {struck}"
    outcome = figures if row.success else f"{row.visited}/{GOALS} goals: {row.cause}; {figures}"
    return f"{row.robot} {row.people} seed {row.seed}: {outcome}"


def _crashed(entry: FlatEntry, sentence: str) -> FlatRow:
    """Return the row of a run that ended with an exception."""
    return FlatRow(
        *entry.key, status=CRASHED, cause=sentence, visited=0, false_goals=0, persons=0, time=0.0,
        driven=0.0, failures={}, drove_into=0, struck_moving=0, struck_standing=0, things=0,
        least_distance=None, intimate=0.0, personal=0.0, collision_time=None, jerk=0.0,
        longest_stand=0.0, standoffs=0, wall_seconds=0.0,
    )  # fmt: skip


def _read(values: dict[str, Any]) -> FlatRow:
    return FlatRow(**values)


FLATS: Work[FlatEntry, FlatRow] = Work(run_flat, _read, line_of, _crashed)
