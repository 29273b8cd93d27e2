"""Runs along random lines, and their table: `treepilot bench line`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from missions.bench.layout import write_world
from missions.bench.perception.line_courses import LineCourse, cross_track, make_course
from missions.bench.perception.table import (
    FAILED,
    PASSED,
    RunRow,
    ending,
    failures,
    groups,
    measure,
)
from missions.bench.perception.truth import TruthRecorder
from missions.bench.resumable import Key, TableOptions, Work
from missions.bench.runs import CRASHED
from missions.execution.prepare import RunOptions, prepare
from missions.execution.report import Report
from missions.execution.resources import MISSIONS
from missions.execution.running import execute
from stack.types import FloatArray

MISSION = MISSIONS / "bench" / "line.yaml"

LIGHTS = {"dim": 0.3, "normal": 1.0, "bright": 2.0}
"""Brightness of the pictures."""

TIME_LIMIT = 240.0
END_RADIUS = 0.15
"""Metres from the end mark in which a robot that is done must stand."""

WRONG_WAY = 0.4
"""Metres from the line beyond which a robot has left it."""

BEGUN = 0.3
"""Metres along the line from which on the distance counts."""


@dataclass(frozen=True)
class LineEntry:
    """One run to make.

    Attributes:
        robot: name or file. light: name of a brightness. seed: of the course and the run.
        folder: of the generated world files.
        speed: m/s.
        parameters: `safety.top_speed` -> value as text.
    """

    robot: str
    light: str
    seed: int
    folder: Path
    speed: float
    parameters: Mapping[str, str]

    @property
    def key(self) -> Key:
        """Unique key of the run in a table."""
        return Path(self.robot).stem, self.light, self.seed


@dataclass(frozen=True, slots=True)
class LineRow(RunRow):
    """One row of the table: a run.

    Attributes:
        status: passed | failed | crashed. cause: why it failed.
        rms: root mean square of the true distance from the line, metres. largest: metres.
        speed: mean along the line, m/s.
        crossed: whether the robot got past the gap.
        junction: whether it took the right branch.
        time: seconds. wall_seconds: compute time.
    """

    robot: str
    light: str
    seed: int
    status: str
    cause: str
    rms: float = 0.0
    largest: float = 0.0
    speed: float = 0.0
    crossed: bool = False
    junction: bool = False
    time: float = 0.0
    wall_seconds: float = 0.0

    @property
    def key(self) -> Key:
        """Key of its entry."""
        return self.robot, self.light, self.seed


def line_entries(
    robots: Sequence[str], seeds: range, folder: Path, speed: float, parameters: Mapping[str, str]
) -> list[LineEntry]:
    """Return the runs, seed by seed, so that an interrupted bench has all kinds of light."""
    return [
        LineEntry(robot, light, seed, folder, speed, parameters)
        for seed in seeds
        for robot in robots
        for light in LIGHTS
    ]


def run_entry(entry: LineEntry) -> LineRow:
    """Make one run.

    Raises:
        InputError: the mission or a parameter has errors.
    """
    began = perf_counter()
    course = make_course(entry.seed)
    plan, options = _plan(entry, course)
    recorder = TruthRecorder()
    report = execute(plan, options, [recorder], lambda: recorder.time >= TIME_LIMIT)
    away, along = cross_track(course.route, recorder.points)
    on_line = along >= BEGUN
    far = float(along[away < WRONG_WAY].max(initial=0.0))
    cause = _cause(course, report, recorder.points[-1], away[on_line])
    times = np.array(recorder.times)[on_line]
    took = float(np.ptp(times)) if len(times) else 0.0
    return LineRow(
        *entry.key, status=FAILED if cause else PASSED, cause=cause,
        rms=round(float(np.sqrt(np.mean(away[on_line] ** 2))), 4) if len(times) else 0.0,
        largest=round(float(away[on_line].max(initial=0.0)), 4),
        speed=round(float(np.ptp(along[on_line])) / took, 3) if took else 0.0,
        crossed=far > float(course.gap[1]) + 0.3,
        junction=far > course.junction + 0.5,
        time=round(report.simulated_seconds, 2), wall_seconds=round(perf_counter() - began, 2),
    )  # fmt: skip


def _plan(entry: LineEntry, course: LineCourse) -> Any:
    name = f"{course.name}_{entry.light}"
    text = course.text(LIGHTS[entry.light])
    case = write_world(text, name, entry.folder / f"{name}.yaml")
    options = RunOptions(
        seed=entry.seed, robot=entry.robot, world=str(case.file), serve=False, camera="asked",
        arguments={"speed": f"{entry.speed:g}", "branch": course.branch},
        parameters=dict(entry.parameters),
    )  # fmt: skip
    return prepare(MISSION, options), options


def _cause(course: LineCourse, report: Report, end: FloatArray, away: FloatArray) -> str:
    """Return why a run failed; empty after a success."""
    status, cause = ending(report)
    if status == FAILED:
        return cause
    if float(np.linalg.norm(end - course.route[-1])) > END_RADIUS:
        return f"ended {np.linalg.norm(end - course.route[-1]):.2f} m from the end mark"
    if away.max(initial=0.0) > WRONG_WAY:
        return f"was {away.max():.2f} m from the line"
    return ""


def line_of(row: LineRow) -> str:
    """Return a run as one line."""
    figures = f"RMS {100 * row.rms:.1f} cm, largest {100 * row.largest:.1f} cm"
    figures += f", {row.speed:.2f} m/s"
    return f"{row.robot}, {row.light}, seed {row.seed}: {row.outcome(figures)}"


def measured(
    entries: Sequence[LineEntry], options: TableOptions, log: Callable[[str], None]
) -> list[LineRow]:
    """Make the runs that are missing in the table; return all.

    Raises:
        InputError: the folder has results of other settings.
    """
    return measure(entries, _settings, options, LINE_WORK, log)


def _settings(entry: LineEntry) -> tuple[str, dict[str, Any]]:
    return f"{entry.robot} {entry.light}", {
        "light": LIGHTS[entry.light], "speed": entry.speed,
        "parameters": dict(entry.parameters), "time_limit": TIME_LIMIT,
    }  # fmt: skip


def rows_of(rows: Sequence[LineRow]) -> list[dict[str, object]]:
    """Return a row of figures for each robot and light."""
    found: list[dict[str, object]] = []
    for (robot, light), group in groups(rows, lambda row: (row.robot, row.light)).items():
        own = group.rows
        found.append({
            "robot": robot, "light": light, "passed": group.share(),
            "95 % interval": group.interval,
            "gaps": group.share(lambda row: row.crossed),
            "junctions": group.share(lambda row: row.junction),
            "RMS": f"{100 * float(np.mean([row.rms for row in own])):.1f} cm",
            "worst RMS": f"{100 * max(row.rms for row in own):.1f} cm",
            "largest": f"{100 * max(row.largest for row in own):.1f} cm",
            "speed": f"{float(np.mean([row.speed for row in own])):.2f} m/s",
        })  # fmt: skip
    return found


def report(rows: Sequence[LineRow]) -> list[str]:
    """Return a line per robot and light, and one per failure."""
    lines = [
        f"{row['robot']:<9}{row['light']:<8}{row['passed']:>6} passed, gaps {row['gaps']}, "
        f"junctions {row['junctions']}, RMS {row['RMS']} (worst {row['worst RMS']}), "
        f"largest {row['largest']}, {row['speed']}"
        for row in rows_of(rows)
    ]
    return lines + failures(rows, line_of)


def _crashed(entry: LineEntry, sentence: str) -> LineRow:
    """Return the row of a run that ended with an exception."""
    return LineRow(*entry.key, status=CRASHED, cause=sentence)


LINE_WORK: Work[LineEntry, LineRow] = Work(run_entry, LineRow.read, line_of, _crashed)
