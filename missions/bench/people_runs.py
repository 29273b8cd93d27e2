"""Runs among people: how one is made, its row, and the figures of several."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

from missions.bench.bench import FAILED, PASSED, Group, Options, Row, robot_label
from missions.bench.conditions import conditions, world_of
from missions.bench.drive_recorder import DriveRecorder, is_end_of_motion
from missions.bench.picture import Drawn, draw_run
from missions.execution.prepare import RunOptions, prepare
from missions.execution.report import Report
from missions.execution.resources import MISSIONS
from missions.execution.running import execute
from stack.errors import InputError
from stack.mapping.whole_files import replace_file
from stack.telemetry.records import Event, MissionState
from stack.telemetry.sinks import Sink
from stack.types import Pose2D

MISSION = MISSIONS / "bench" / "flats.yaml"

FALSE_GOAL = 0.5
"""Metres from a goal reported as reached, beyond which the report is false."""

TIME_LIMIT = 900.0
"""Seconds after which a run ends."""

MODELS = ("none", "social_force", "polite", "unaware")
"""What the people are: nobody; by social forces; on loops, and stop for a robot ahead; on loops,
and react to nobody."""

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
        options: of the bench.
    """

    scene: str
    robot: str
    people: str
    seed: int
    make: Callable[[PeopleEntry], PeopleCase]
    options: Options

    @property
    def key(self) -> tuple[str, str, str, int]:
        """Unique key of the run in a table."""
        return self.scene, robot_label(self.robot), self.people, self.seed

    @property
    def label(self) -> str:
        """Scene and robot."""
        return f"{self.scene} {robot_label(self.robot)}"


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
class PeopleRow(Row):
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
    """

    scene: str
    robot: str
    people: str
    seed: int
    status: str
    cause: str
    goals: int = 0
    visited: int = 0
    false_goals: int = 0
    persons: int = 0
    time: float = 0.0
    driven: float = 0.0
    failures: dict[str, int] = field(default_factory=dict)
    drove_into: int = 0
    struck_moving: int = 0
    struck_standing: int = 0
    things: int = 0
    least_distance: float | None = None
    intimate: float = 0.0
    personal: float = 0.0
    collision_time: float | None = None
    jerk: float = 0.0
    longest_stand: float = 0.0
    standoffs: int = 0
    wall_seconds: float = 0.0

    @property
    def figures(self) -> str:
        """Its most important figures as text."""
        return (
            f"{self.visited}/{self.goals} goals, {self.time:.0f} s, {self.driven:.0f} m, drove into"
            f" {self.drove_into}, struck {self.struck_moving + self.struck_standing}"
        )


class FailureCodes(Sink):
    """A telemetry sink that counts failed drives by code, and contacts with things.

    Attributes:
        codes: number of failed drives by code. last: the last of them, in words.
        things: contacts with anything but people.
    """

    def __init__(self) -> None:
        self.codes: Counter[str] = Counter()
        self.things = 0
        self.last = ""

    def event(self, event: Event) -> None:
        """Count an event."""
        if is_end_of_motion(event, "failed"):
            self.codes[str(event.fields.get("code"))] += 1
            self.last = event.text
        elif event.kind == "contact":
            self.things += not event.fields["is_person"]


def write_shared_world(entry: PeopleEntry, name: str, text: str) -> Path:
    """Write the world file of a run, unless it is there; return its path.

    The runs of all robots share the file: other processes may be reading it.
    """
    folder = entry.options.worlds
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{name}_{entry.seed}_{entry.people}.yaml"
    if not file.exists() or file.read_text("utf-8") != text:
        replace_file(file, text.encode())
    return file.resolve()


def check_people(options: Options) -> None:
    """Check the kinds of people.

    Raises:
        InputError: there is no such kind.
    """
    for model in options.people:
        if model not in MODELS:
            raise InputError(f"--people {model}: choose from {', '.join(MODELS)}")


def options_of(entry: PeopleEntry, case: PeopleCase) -> RunOptions:
    """Return the options of a run."""
    name, keep = "-".join(map(str, entry.key)).replace(" ", "_"), entry.options.keep
    return RunOptions(
        seed=entry.seed, robot=entry.robot, arguments={"goals": case.argument},
        world=str(case.file), out=None if keep is None else keep / name,
        serve=False, camera="off", parameters=dict(entry.options.parameters),
    )  # fmt: skip


def settings_of(entry: PeopleEntry) -> dict[str, Any]:
    """Return the conditions of the runs in a scene, with the world and the goals of one of them.

    It is the same one for all runs, so that a table can be continued with other seeds and people.
    """
    one = replace(entry, seed=0, people="unaware")
    options = options_of(one, one.make(one))
    plan = prepare(MISSION, options)
    return {**conditions(plan, options), "world": world_of(plan), "time_limit": TIME_LIMIT}


def run_entry(entry: PeopleEntry, picture: Path) -> PeopleRow:
    """Make one run, and draw it if it fails. A robot that does not fit at its start has failed."""
    case = entry.make(entry)
    options = options_of(entry, case)
    try:
        plan = prepare(MISSION, options)
    except InputError as error:  # of this world: `settings_of` has checked all else
        goals = len(case.goals)
        return PeopleRow(*entry.key, FAILED, str(error), goals=goals, persons=case.people)
    recorder, codes = DriveRecorder(), FailureCodes()
    report = execute(plan, options, [recorder, codes], lambda: recorder.time >= TIME_LIMIT)
    false = sum(goal.distance_to(truth) > FALSE_GOAL for goal, truth in recorder.reached)
    visited = int(report.blackboard.get("visited", "0"))
    people = report.people or NOBODY
    by = Counter(item["by"] for item in people["contacts"])
    whole = visited == len(case.goals) and not false
    row = PeopleRow(
        *entry.key, status=PASSED if whole else FAILED,
        cause="" if whole else _cause(report, recorder.time, false, codes.last),
        goals=len(case.goals), visited=visited, false_goals=false, persons=case.people,
        time=round(report.simulated_seconds, 2), driven=round(report.distance_m or 0.0, 2),
        failures=dict(codes.codes), drove_into=by["robot"],
        struck_moving=by["person, robot moving"], struck_standing=by["person, robot standing"],
        things=codes.things, least_distance=people["least_distance"],
        intimate=people["seconds_intimate"], personal=people["seconds_personal"],
        collision_time=people["least_time_to_collision"], jerk=round(recorder.jerk, 3),
        longest_stand=people["longest_stand"], standoffs=people["standoffs"],
    )  # fmt: skip
    if not row.success:
        draw_run(picture, plan, Drawn((recorder.trace,), case.goals), row.line)
    return row


def _cause(report: Report, time: float, false_goals: int, last_failed: str) -> str:
    """Return why a run failed; a failed drive before a timeout may have been recovered."""
    if false_goals:
        return f"{false_goals} false goals"
    if report.status == MissionState.INTERRUPTED and time >= TIME_LIMIT:
        return f"not finished after {TIME_LIMIT:g} s"
    return last_failed or report.reason


Alone = Mapping[tuple[str, str, int], PeopleRow]
"""Runs without people by scene, robot and seed."""


def alone(rows: Sequence[PeopleRow]) -> Alone:
    """Return the runs without people that passed: with them the others are compared."""
    return {
        (row.scene, row.robot, row.seed): row
        for row in rows
        if row.people == "none" and row.success
    }


def figures(rows: Sequence[PeopleRow], empty: Alone) -> dict[str, object]:
    """Return the figures of several runs; `empty` are the runs without people."""
    pairs = [(row, empty.get((row.scene, row.robot, row.seed))) for row in rows if row.success]
    times = [row.time / other.time for row, other in pairs if other is not None]
    ways = [row.driven / other.driven for row, other in pairs if other is not None]
    distances = [row.least_distance for row in rows if row.least_distance is not None]
    group = Group(rows)
    return {
        "all goals": group.share(),
        "95 % interval": group.interval,
        "goals": f"{group.total(lambda row: row.visited)}/{group.total(lambda row: row.goals)}",
        "false": group.total(lambda row: row.false_goals),
        "drove into": group.total(lambda row: row.drove_into),
        "struck moving": group.total(lambda row: row.struck_moving),
        "struck standing": group.total(lambda row: row.struck_standing),
        "things": group.total(lambda row: row.things),
        "time": f"{median(times):.2f}" if times else "",
        "way": f"{median(ways):.2f}" if ways else "",
        "standoffs": group.total(lambda row: row.standoffs),
        "intimate": f"{sum(row.intimate for row in rows) / max(1, len(rows)):.1f} s",
        "least distance": f"{median(distances):.2f} m" if distances else "",
    }
