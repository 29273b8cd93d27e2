"""One run among people, and its row in a table: of `bench flats` and `bench people`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from missions.bench.drive_recorder import DriveRecorder, is_end_of_motion
from missions.bench.people.oracle import Task, judge
from missions.bench.people.oracle_picture import draw_verdict
from missions.bench.resumable import Key, Work
from missions.bench.runs import CRASHED
from missions.execution.prepare import RunOptions, prepare
from missions.execution.report import Report
from missions.execution.resources import MISSIONS
from missions.execution.running import execute
from stack.mapping.whole_files import replace_file
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot
from stack.types import Pose2D

MISSION = MISSIONS / "bench" / "flats.yaml"

FALSE_GOAL = 0.5
"""Metres from a goal reported as reached, beyond which the report is false."""

TIME_LIMIT = 900.0
"""Seconds after which a run ends."""

PICTURES = "oracle"
"""Folder of the oracle's pictures of runs that failed or that nobody could have passed."""

PASSED, FAILED = "passed", "failed"

NOBODY: dict[str, Any] = {
    "contacts": [], "least_distance": None, "seconds_intimate": 0.0, "seconds_personal": 0.0,
    "least_time_to_collision": None, "standoffs": 0, "longest_stand": 0.0,
}  # fmt: skip
"""Measures of a run without people."""


@dataclass(frozen=True)
class PeopleEntry:
    """One run to make.

    Attributes:
        scene: name of the scene. robot: name or file. people: kind of people. seed: of all that is
            drawn, and of the run.
        make: generates the world of an entry; a top-level function.
        folder: of the generated world files.
        parameters: `controller.cruise_speed` -> value as text.
        keep: folder for the records of the run; None keeps none.
    """

    scene: str
    robot: str
    people: str
    seed: int
    make: Callable[[PeopleEntry], PeopleCase]
    folder: Path
    parameters: Mapping[str, str]
    keep: Path | None = None

    @property
    def key(self) -> Key:
        """Unique key of the run in a table."""
        return f"{self.scene} {Path(self.robot).stem}", self.people, self.seed


@dataclass(frozen=True)
class PeopleCase:
    """The world of a run as a file, the goals, and the number of the people."""

    file: Path
    goals: tuple[Pose2D, ...]
    people: int

    @property
    def argument(self) -> str:
        """The goals as the mission's argument."""
        return json.dumps([[pose.x, pose.y, pose.heading] for pose in self.goals])

    def command(self, robot: str, seed: int) -> str:
        """Return the command line that runs this case alone."""
        options = f"--world {self.file} --robot {robot} --seed {seed}"
        return f"treepilot run {MISSION} {options} --set 'goals={self.argument}'"


@dataclass(frozen=True, slots=True)
class PeopleRow:
    """One row of the table: a run.

    Attributes:
        status: passed (all goals reached) | failed | crashed. cause: why it failed.
        visited: number of goals reached, of `goals`. false_goals: reported as reached that were
            not.
        persons: people in the world.
        time: seconds on the run's clock. driven: metres.
        failures: number of failed drives by their code.
        drove_into: contacts with people into which the robot drove. struck_moving, struck_standing:
            those in which a person walked into it, while it moved and while it stood.
        things: contacts with things.
        least_distance: to a person, metres; None without people. intimate, personal: seconds in
            Hall's zones.
        collision_time: smallest time to collision, seconds; None: never below 10.
        jerk: root mean square, m/s³. longest_stand: seconds. standoffs: of more than 20 s.
        possible: whether anybody could have reached all goals without a contact, by the oracle;
            None where it cannot tell. oracle_time: seconds, earliest arrival at the last goal.
    """

    scene: str
    robot: str
    people: str
    seed: int
    status: str
    cause: str
    goals: int
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
    possible: bool | None = None
    oracle_time: float | None = None

    @property
    def success(self) -> bool:
        """Whether all goals were reached."""
        return self.status == PASSED

    @property
    def key(self) -> Key:
        """Key of its entry."""
        return f"{self.scene} {self.robot}", self.people, self.seed


class FailureCodes:
    """A telemetry sink that counts the failed drives by their code, and contacts with things.

    Args:
        people: their names; contacts with them are counted elsewhere.
    """

    def __init__(self, people: Iterable[str]) -> None:
        self._people = tuple(f"contact with {name} at " for name in people)
        self.codes: Counter[str] = Counter()
        self.things = 0
        self.last = ""

    def open(self, info: RunInfo) -> None:
        """Do nothing."""

    def event(self, event: Event) -> None:
        """Count an event."""
        if is_end_of_motion(event, "failed"):
            self.codes[str(event.fields.get("code"))] += 1
            self.last = event.text
        elif event.kind == "contact" and not event.text.startswith(self._people):
            self.things += 1

    def wants_snapshot(self, time: float) -> bool:
        """Return False: no snapshot is needed."""
        return False

    def snapshot(self, snapshot: Snapshot) -> None:
        """Ignore the final snapshot, which every sink receives."""

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Do nothing."""


def write_shared_world(entry: PeopleEntry, name: str, text: str) -> Path:
    """Write the world file of a run, unless it is there; return its path.

    The runs of all robots share the file: other processes may be reading it.
    """
    entry.folder.mkdir(parents=True, exist_ok=True)
    file = entry.folder / f"{name}_{entry.seed}_{entry.people}.yaml"
    if not file.exists() or file.read_text("utf-8") != text:
        replace_file(file, text.encode())
    return file.resolve()


def options_of(entry: PeopleEntry, case: PeopleCase) -> RunOptions:
    """Return the options of a run."""
    name = "-".join(map(str, entry.key)).replace(" ", "_")
    records = None if entry.keep is None else entry.keep / name
    return RunOptions(
        seed=entry.seed, robot=entry.robot, arguments={"goals": case.argument},
        world=str(case.file), out=records,
        serve=False, camera="off", parameters=dict(entry.parameters),
    )  # fmt: skip


def run_entry(entry: PeopleEntry) -> PeopleRow:
    """Make one run.

    Raises:
        InputError: the mission or a parameter has errors.
    """
    began = perf_counter()
    case = entry.make(entry)
    options = options_of(entry, case)
    plan = prepare(MISSION, options)
    recorder = DriveRecorder()
    codes = FailureCodes(person.name for person in plan.world.people)
    report = execute(plan, options, [recorder, codes], lambda: recorder.time >= TIME_LIMIT)
    false = sum(goal.distance_to(truth) > FALSE_GOAL for goal, truth in recorder.reached)
    visited = int(report.blackboard.get("visited", "0"))
    people = report.people or NOBODY
    by = Counter(item["by"] for item in people["contacts"])
    whole = visited == len(case.goals) and not false
    task = Task(plan.start, case.goals, FALSE_GOAL, TIME_LIMIT)
    verdict = judge(plan.world, plan.robot, entry.seed, task)
    if verdict is not None and not (whole and verdict.possible):
        name = f"{'-'.join(map(str, entry.key)).replace(' ', '_')}.png"
        draw_verdict(entry.folder.parent / PICTURES / Path(name).name, verdict, case.goals)
    return PeopleRow(
        *_names(entry), status=PASSED if whole else FAILED,
        cause="" if whole else _cause(report, recorder.time, false, codes.last),
        goals=len(case.goals), visited=visited, false_goals=false, persons=case.people,
        time=round(report.simulated_seconds, 2), driven=round(report.distance_m, 2),
        failures=dict(codes.codes), drove_into=by["robot"],
        struck_moving=by["person, robot moving"], struck_standing=by["person, robot standing"],
        things=codes.things, least_distance=people["least_distance"],
        intimate=people["seconds_intimate"], personal=people["seconds_personal"],
        collision_time=people["least_time_to_collision"], jerk=round(recorder.jerk, 3),
        longest_stand=people["longest_stand"], standoffs=people["standoffs"],
        wall_seconds=round(perf_counter() - began, 2),
        possible=None if verdict is None else verdict.possible,
        oracle_time=None if verdict is None else verdict.time,
    )  # fmt: skip


def _cause(report: Report, time: float, false_goals: int, last_failed: str) -> str:
    """Return why a run failed; a failed drive before a timeout may have been recovered."""
    if false_goals:
        return f"{false_goals} false goals"
    if report.status == MissionState.INTERRUPTED and time >= TIME_LIMIT:
        return f"not finished after {TIME_LIMIT:g} s"
    return last_failed or report.reason


def line_of(row: PeopleRow) -> str:
    """Return a run as one line."""
    figures = f"{row.time:.0f} s, {row.driven:.0f} m"
    if row.drove_into or row.struck_moving or row.struck_standing:
        struck = row.struck_moving + row.struck_standing
        figures += f", drove into {row.drove_into}, struck {struck}"
    outcome = figures if row.success else f"{row.visited}/{row.goals} goals: {row.cause}; {figures}"
    return f"{row.scene}, {row.robot}, {row.people} seed {row.seed}: {outcome}"


def _names(entry: PeopleEntry) -> tuple[str, str, str, int]:
    return entry.scene, Path(entry.robot).stem, entry.people, entry.seed


def _crashed(entry: PeopleEntry, sentence: str) -> PeopleRow:
    """Return the row of a run that ended with an exception."""
    return PeopleRow(
        *_names(entry), status=CRASHED, cause=sentence, goals=0, visited=0, false_goals=0,
        persons=0, time=0.0, driven=0.0, failures={}, drove_into=0, struck_moving=0,
        struck_standing=0, things=0,
        least_distance=None, intimate=0.0, personal=0.0, collision_time=None, jerk=0.0,
        longest_stand=0.0, standoffs=0, wall_seconds=0.0,
    )  # fmt: skip


def _read(values: dict[str, Any]) -> PeopleRow:
    return PeopleRow(**values)


PEOPLE_WORK: Work[PeopleEntry, PeopleRow] = Work(run_entry, _read, line_of, _crashed)
