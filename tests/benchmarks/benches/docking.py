"""A charger with contacts, docked at from random starts with a wrong initial pose.

A run passes when the battery charges. The error is that of the true pose at the end.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, hypot, pi, radians
from pathlib import Path
from typing import Any

import numpy as np

from missions.bench.bench import Bench, Options, Row, Rows, groups
from missions.bench.layout import write_world
from missions.execution.prepare import RunOptions, prepare
from missions.execution.running import execute
from stack.streams import stream
from stack.types import Pose2D, wrap_angle
from tests.benchmarks.benchmark import FILES, HELD_OUT, Benchmark, Given, table
from tests.benchmarks.layouts import Layout
from tests.benchmarks.robot_entry import RobotEntry
from tests.benchmarks.truth import TruthRecorder, ending

MISSION = FILES / "docking.yaml"

TIME_LIMIT = 240.0
GAP = 0.02
"""Metres between the robot's front and the dock that `dock` aims at."""

FARTHEST, NEAREST = 3.0, 0.9
"""Metres of the start from the dock."""

GUESS_OFF, GUESS_TURN = 0.15, radians(8.0)
"""Standard deviations of the pose that the robot begins with: metres and radians."""

ROOM = ((0.0, 5.0), (-2.6, 2.6))
"""x and y of the walls; the dock's face is at x = 0.2, y = 0."""

FACE = Pose2D(0.2, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class DockingRow(Row):
    """One row of the table: a run.

    Attributes:
        status: passed (the battery charges) | failed | crashed. cause: why it failed.
        error: true distance from the aimed at pose at the end, metres. turn: heading error,
            radians.
        contacts: of the robot with anything.
        time: seconds. wall_seconds: compute time.
    """

    robot: str
    seed: int
    status: str
    cause: str
    error: float = 0.0
    turn: float = 0.0
    contacts: int = 0
    time: float = 0.0
    wall_seconds: float = 0.0

    @property
    def figures(self) -> str:
        """Its most important figures as text."""
        error = f"{1000 * self.error:.0f} mm, {degrees(self.turn):.1f} deg"
        return f"{error}, {self.time:.0f} s, {self.contacts} contacts"


def entries_of(options: Options) -> list[RobotEntry]:
    """Return the runs, seed by seed."""
    return [RobotEntry(robot, seed, options) for seed in options.seeds for robot in options.robots]


def world_text(seed: int) -> tuple[str, Pose2D]:
    """Return the world file of a seed, and the pose that the robot begins with.

    The dock stands at a wall. Two boxes and a cylinder stand beside the way from it into the room,
    and the start is in front of it, with any heading.
    """
    random = stream(seed, "docking")
    (x_min, x_max), (y_min, y_max) = ROOM
    while True:
        distance, bearing = random.uniform(NEAREST, FARTHEST), random.uniform(-1.2, 1.2)
        start = FACE.compose(Pose2D(float(distance * np.cos(bearing)),
                                    float(distance * np.sin(bearing)),
                                    float(random.uniform(-pi, pi))))  # fmt: skip
        if x_min + 0.7 < start.x < x_max - 0.7 and y_min + 0.7 < start.y < y_max - 0.7:
            break
    things: list[tuple[float, float, float]] = []
    while len(things) < 3:
        x, y = random.uniform(0.5, x_max - 0.5), random.uniform(y_min + 0.4, y_max - 0.4)
        if abs(y) > 0.9 and hypot(x - start.x, y - start.y) > 1.0:
            things.append((round(float(x), 2), round(float(y), 2), float(random.uniform(0, 180))))
    boxes = [
        {"at": [x, y, f"{turn:.0f} deg"], "size": [0.5, 0.3, 0.8]} for x, y, turn in things[:2]
    ]
    corners = [[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]]
    guess = Pose2D(
        start.x + float(random.normal(0.0, GUESS_OFF)),
        start.y + float(random.normal(0.0, GUESS_OFF)),
        start.heading + float(random.normal(0.0, GUESS_TURN)),
    )
    text = "\n".join([
        f"world: docking_{seed}", "format: 1", f"start: {json.dumps(_written(start))}",
        f"places: {{hall: {json.dumps(_written(start))}}}",
        f"walls: [{{points: {json.dumps(corners)}, closed: true}}]",
        f"boxes: {json.dumps(boxes)}",
        f"cylinders: [{{at: {json.dumps(things[2][:2])}, radius: 0.2}}]",
        f"docks: [{{at: [{FACE.x}, {FACE.y}], facing: 0}}]", "",
    ])  # fmt: skip
    return text, guess


def _written(pose: Pose2D) -> list[Any]:
    return [round(pose.x, 3), round(pose.y, 3), f"{degrees(pose.heading):.2f} deg"]


def run_entry(entry: RobotEntry, picture: Path) -> DockingRow:
    """Make one run.

    Raises:
        InputError: the mission or a parameter has errors.
    """
    text, guess = world_text(entry.seed)
    name = f"docking_{entry.seed}"
    case = write_world(text, name, entry.options.worlds / f"{name}.yaml")
    options = RunOptions(
        seed=entry.seed, robot=entry.robot, world=str(case.file), serve=False,
        arguments={
            "guess": json.dumps(_written(guess)), "charger": json.dumps(_written(FACE)),
        },
        parameters=dict(entry.options.parameters),
    )  # fmt: skip
    plan, recorder = prepare(MISSION, options), TruthRecorder()
    report = execute(plan, options, [recorder], lambda: recorder.time >= TIME_LIMIT)
    end = recorder.poses[-1].relative_to(FACE)
    status, cause = ending(report)
    return DockingRow(
        Path(entry.robot).stem, entry.seed, status=status, cause=cause,
        error=round(hypot(end.x - plan.robot.footprint.front - GAP, end.y), 4),
        turn=round(abs(wrap_angle(end.heading - pi)), 4),
        contacts=report.collisions or 0, time=round(report.simulated_seconds, 2),
    )  # fmt: skip


def settings_of(entry: RobotEntry) -> dict[str, Any]:
    """Return what the runs of a robot depend on."""
    return {"parameters": dict(entry.options.parameters), "time_limit": TIME_LIMIT}


def table_of(rows: Sequence[DockingRow]) -> Rows:
    """Return a row of figures for each robot."""
    found: Rows = []
    for robot, group in groups(rows, lambda row: row.robot).items():
        own, good = group.rows, group.good
        found.append({
            "robot": robot, "charging": group.share(),
            "95 % interval": group.interval,
            "exact": group.share(_is_exact),
            "median error": f"{1000 * float(np.median([row.error for row in good])):.1f} mm",
            "largest error": f"{1000 * max(row.error for row in good):.1f} mm",
            "largest turn": f"{degrees(max(row.turn for row in good)):.1f} deg",
            "contacts": sum(row.contacts for row in own),
            "median time": f"{float(np.median([row.time for row in good])):.0f} s",
        })  # fmt: skip
    return found


def _is_exact(row: DockingRow) -> bool:
    return row.success and row.error <= 0.01 and row.turn <= radians(1.5)


DOCKING = Bench(DockingRow, entries_of, run_entry, settings_of, table_of)


def measure(given: Given) -> Rows:
    """Return a row for each robot, from starts that were not used for development."""
    seeds = given.seeds(HELD_OUT, given["starts"])
    return table(DOCKING, given.options("docking", seeds, robots=("scout", "jackal")))


LAYOUT = Layout({
    "robot": "{robot}", "charging": "{charging}", "95 %": "{95 % interval}",
    "within 1 cm and 1.5 deg": "{exact}", "median error": "{median error}",
    "largest": "{largest error}", "largest turn": "{largest turn}", "contacts": "{contacts}",
    "median time": "{median time}",
})  # fmt: skip
BENCHMARKS = {
    "docking": Benchmark(
        "Docking from random starts", measure, ("starts",),
        {"recording": "off", "first seed": HELD_OUT}, LAYOUT,
    )
}  # fmt: skip
