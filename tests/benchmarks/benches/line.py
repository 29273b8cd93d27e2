"""Random lines on the floor, followed with the camera in dim, normal and bright light.

A run passes when the robot stops at the end mark. The distance is that of its true position from
the line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from missions.bench.bench import FAILED, PASSED, Bench, Row, Rows, groups
from missions.bench.layout import write_world
from missions.execution.prepare import RunOptions, prepare
from missions.execution.report import Report
from missions.execution.running import execute
from stack.types import FloatArray
from tests.benchmarks.benchmark import FILES, HELD_OUT, Benchmark, Given, MoreOptions, table
from tests.benchmarks.layouts import Layout
from tests.benchmarks.line_courses import LineCourse, cross_track, make_course
from tests.benchmarks.truth import TruthRecorder, ending

MISSION = FILES / "line.yaml"

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
        options: of the bench.
    """

    robot: str
    light: str
    seed: int
    options: MoreOptions

    @property
    def key(self) -> tuple[str, str, int]:
        """Unique key of the run in a table."""
        return Path(self.robot).stem, self.light, self.seed

    @property
    def label(self) -> str:
        """Robot and light."""
        return f"{self.robot} {self.light}"


@dataclass(frozen=True, slots=True)
class LineRow(Row):
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
    def figures(self) -> str:
        """Its most important figures as text."""
        return (
            f"RMS {100 * self.rms:.1f} cm, largest {100 * self.largest:.1f} cm,"
            f" {self.speed:.2f} m/s"
        )


def entries_of(options: MoreOptions) -> list[LineEntry]:
    """Return the runs, seed by seed, so that an interrupted bench has all kinds of light."""
    return [
        LineEntry(robot, light, seed, options)
        for seed in options.seeds
        for robot in options.robots
        for light in LIGHTS
    ]


def run_entry(entry: LineEntry, picture: Path) -> LineRow:
    """Make one run.

    Raises:
        InputError: the mission or a parameter has errors.
    """
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
        time=round(report.simulated_seconds, 2),
    )  # fmt: skip


def _plan(entry: LineEntry, course: LineCourse) -> Any:
    name = f"{course.name}_{entry.light}"
    text = course.text(LIGHTS[entry.light])
    case = write_world(text, name, entry.options.worlds / f"{name}.yaml")
    options = RunOptions(
        seed=entry.seed, robot=entry.robot, world=str(case.file), serve=False, camera="asked",
        arguments={"speed": f"{entry.options.speed:g}", "branch": course.branch},
        parameters=dict(entry.options.parameters),
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


def settings_of(entry: LineEntry) -> dict[str, Any]:
    """Return what the runs of a robot in a light depend on."""
    return {
        "light": LIGHTS[entry.light], "speed": entry.options.speed,
        "parameters": dict(entry.options.parameters), "time_limit": TIME_LIMIT,
    }  # fmt: skip


def table_of(rows: Sequence[LineRow]) -> Rows:
    """Return a row of figures for each robot and light."""
    found: Rows = []
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


LINE = Bench(LineRow, entries_of, run_entry, settings_of, table_of)


def measure(given: Given) -> Rows:
    """Return a row for each light, on courses that were not used for development."""
    seeds = given.seeds(HELD_OUT, given["worlds"])
    return table(LINE, given.options("line", seeds, robots=("scout",)))


LAYOUT = Layout({
    "light": "{light}", "end mark reached": "{passed}", "95 %": "{95 % interval}",
    "gaps": "{gaps}", "junctions": "{junctions}", "mean RMS": "{RMS}",
    "worst RMS": "{worst RMS}", "largest": "{largest}", "mean speed": "{speed}",
})  # fmt: skip
BENCHMARKS = {
    "line": Benchmark(
        "Random lines on the floor, 0.4 m/s", measure, ("worlds",),
        {"recording": "off", "first seed": HELD_OUT}, LAYOUT,
    )
}  # fmt: skip
