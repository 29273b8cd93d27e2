"""What a report tells of one run, gathered from its folder."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missions.execution.records.inputs import COPIES
from missions.execution.records.plan_facts import PlanFacts, read_facts
from missions.execution.report import read_fields
from missions.inspection.page.blockers import Blocker, blockers_of
from missions.inspection.page.failed_nodes import FailedNode, Failures, failures_of
from missions.inspection.trace_model import Node, Trace, read_trace
from stack.documents.files import YAML_BYTES, read_bytes
from stack.runtime.holdups import Hold, holds_of
from stack.telemetry.records import Event, Snapshot
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import FloatArray, Footprint, OccupancyGrid

MOST_SAMPLES = 1500
"""Samples of the whole run that are drawn."""

FASTEST = 5.0
"""Speed in m/s above which a robot was lifted and has not driven."""

NEAREST_BEAMS = 3
"""Beams below a distance that make it the distance to something: one alone may be noise."""


@dataclass(frozen=True)
class Samples:
    """Figures of the run over its time, n samples.

    Attributes:
        time: seconds. x, y: of the estimate, map frame, metres; of the tool of a robot that has an
            arm and no wheels, and so its speed. All other figures of driving are NaN then.
        true_x, true_y: of the truth, map frame, metres; NaN without a simulation.
        speed: measured, m/s; commanded: m/s.
        nearest: distance from the lidar to the nearest thing, metres; NaN without a scan.
        stale: whether the newest scan was too old to drive by.
        health: of the localisation. deviation: of the estimate, metres.
        error: distance of the estimate from the truth, metres; NaN without a simulation.
        compute: milliseconds of a step, mean since the sample before.
        joints: speed of the fastest joint of the arm, rad/s. fingers: width between them, mm.
        grip: force with which they press, N. NaN without an arm.
    """

    time: FloatArray
    x: FloatArray
    y: FloatArray
    true_x: FloatArray
    true_y: FloatArray
    speed: FloatArray
    commanded: FloatArray
    nearest: FloatArray
    stale: NDArray[np.bool_]
    health: FloatArray
    deviation: FloatArray
    error: FloatArray
    compute: FloatArray
    joints: FloatArray
    fingers: FloatArray
    grip: FloatArray

    @property
    def true_speed(self) -> FloatArray:
        """Speed of the truth between two samples, m/s; NaN where it is unknown or was lifted."""
        if len(self.time) < 2:
            return np.full(len(self.time), np.nan)
        moved = np.hypot(np.diff(self.true_x), np.diff(self.true_y))
        speed = moved / np.maximum(np.diff(self.time), 1e-9)
        speed[speed > FASTEST] = np.nan
        return np.append(np.nan, speed)

    @property
    def true_distance(self) -> float:
        """Metres that the robot really drove, without lifts; NaN where it is unknown."""
        moved = self.true_speed[1:] * np.diff(self.time)
        return float(np.nansum(moved)) if np.isfinite(moved).any() else float("nan")


@dataclass(frozen=True)
class Bar:
    """A time in which a node ran, and how it ended: success | failure | idle | running."""

    begin: float
    end: float
    outcome: str


@dataclass
class Story:
    """A run, as a report tells it.

    Attributes:
        folder: of the run.
        trace: its events and trees.
        samples: figures over time.
        last: the last snapshot.
        report: what can be read of it (missions/execution/report.py); None of a run that ended
            without one.
        drives: whether its base moves.
        facts: what was known before it began.
        blockers: doors and people that blocked the robot.
    """

    folder: Path
    trace: Trace
    samples: Samples
    last: Snapshot
    title: str
    robot: str
    world: str
    places: dict[str, tuple[float, float]]
    footprint: Footprint
    drives: bool
    report: dict[str, Any] | None
    facts: PlanFacts
    blockers: tuple[Blocker, ...] = ()
    _lines: dict[str, list[str]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the run's folder."""
        return self.folder.name

    @property
    def end(self) -> float:
        """Robot time of the last snapshot, seconds."""
        return float(self.samples.time[-1])

    @property
    def over(self) -> float:
        """Robot time at which the mission ended, seconds; of the last snapshot if it did not."""
        ends = (event.time for event in reversed(self.events) if event.kind == "mission_ended")
        return next(ends, self.end)

    @property
    def status(self) -> str:
        """Outcome in a word."""
        return str((self.report or {}).get("status", self.last.state))

    @property
    def reason(self) -> str:
        """Why it ended so; may be empty."""
        return str((self.report or {}).get("reason", self.last.reason))

    @property
    def grid(self) -> OccupancyGrid | None:
        """The map at the end."""
        layer = self.last.layers.get("map")
        content = layer.content if layer is not None else None
        return content if isinstance(content, OccupancyGrid) else None

    @property
    def events(self) -> tuple[Event, ...]:
        """All events."""
        return self.trace.events

    @cached_property
    def failures(self) -> Failures:
        """The nodes that failed."""
        return failures_of(self.trace, self.line_of)

    @property
    def failed(self) -> FailedNode | None:
        """The node whose failure ended the mission; None if it did not end so."""
        return self.failures.last if self.status == "failure" else None

    @cached_property
    def bars(self) -> list[tuple[int, Node, list[Bar]]]:
        """Depth, node and times of running of each node that was ever ticked, in drawing order."""
        rows = []
        for number, tree in enumerate(self.trace.trees):
            spans: dict[int, list[Bar]] = {node.id: [] for node in tree.nodes.values()}
            begun: dict[int, float] = {}
            for event, _, at in self.trace.with_trees():
                if at != number or event.kind != "node_status":
                    continue
                node, to = int(event.fields["node"]), str(event.fields["to"])
                begin = begun.pop(node, None)
                if begin is not None or to in ("success", "failure"):
                    spans[node].append(Bar(event.time if begin is None else begin, event.time, to))
                if to == "running":
                    begun[node] = event.time
            for identity, begin in begun.items():
                spans[identity].append(Bar(begin, self.end, "running"))
            rows += [
                (tree.depth(node), node, spans[node.id])
                for node in tree.nodes.values()
                if spans[node.id]
            ]
        return rows

    @cached_property
    def holds(self) -> list[Hold]:
        """What held the robot, and when."""
        return holds_of(self.events, self.over)

    def line_of(self, where: str) -> str:
        """Text of a line of the mission, as in: office_patrol.yaml:21."""
        file, _, number = where.rpartition(":")
        if not number.isdecimal() or not file:
            return ""
        if file not in self._lines:
            self._lines[file] = self._read_lines(file)
        lines, at = self._lines[file], int(number) - 1
        return lines[at].strip() if 0 <= at < len(lines) else ""

    def _read_lines(self, file: str) -> list[str]:
        """Lines of a file of the mission; none if two files have this name."""
        copies = list((self.folder / COPIES).rglob(Path(file).name))
        if len(copies) > 1:
            return []
        try:
            content = read_bytes((copies or [self.folder / "mission.yaml"])[0], YAML_BYTES)
        except OSError:
            return []
        return content.decode("utf-8", "replace").splitlines()


def read_story(folder: Path) -> Story:
    """Gather what a report tells of a run.

    Raises:
        InputError: the folder has no snapshots or no events.
    """
    trace, facts = read_trace(folder), read_facts(folder)
    with SnapshotRecording(folder) as recording:
        count = len(recording.times)
        numbers = sorted({*range(0, count, -(-count // MOST_SAMPLES)), count - 1})
        shots = [recording.snapshot(number, whole=False) for number in numbers]
        last, info = recording.snapshot(count - 1), recording.info
        samples = _samples(shots)
        if not info.drives:
            samples = _of_tool(samples, shots)
        blockers = blockers_of(trace.events, recording, shots, facts)
    return Story(
        folder, trace, samples, last, info.title or info.mission, info.robot, info.world,
        {name: (pose.x, pose.y) for name, pose in info.places.items()}, info.footprint,
        info.drives, read_fields(folder), facts, blockers,
    )  # fmt: skip


def _samples(shots: list[Snapshot]) -> Samples:
    def values(read: Any) -> FloatArray:
        return np.array([read(shot) for shot in shots], dtype=np.float64)

    return Samples(
        time=values(lambda shot: shot.time),
        x=values(lambda shot: shot.pose.x),
        y=values(lambda shot: shot.pose.y),
        true_x=values(lambda shot: np.nan if shot.truth is None else shot.truth.x),
        true_y=values(lambda shot: np.nan if shot.truth is None else shot.truth.y),
        speed=values(lambda shot: np.hypot(shot.measured.linear, shot.measured.lateral)),
        commanded=values(lambda shot: np.hypot(shot.commanded.linear, shot.commanded.lateral)),
        nearest=values(_nearest),
        stale=np.array([shot.old_scan > 0.0 for shot in shots]),
        health=values(lambda shot: shot.health),
        deviation=values(lambda shot: np.sqrt(max(0.0, np.trace(shot.covariance[:2, :2])))),
        error=values(
            lambda shot: np.nan if shot.truth is None else shot.pose.distance_to(shot.truth)
        ),
        compute=_compute(shots),
        joints=values(lambda shot: np.nan if shot.arm is None else shot.arm.speed),
        fingers=values(lambda shot: np.nan if shot.arm is None else 1e3 * shot.arm.width),
        grip=values(lambda shot: np.nan if shot.arm is None else shot.arm.force),
    )


def _of_tool(samples: Samples, shots: list[Snapshot]) -> Samples:
    """The same of the tool instead of the base, which does not move."""
    unknown = np.full(len(shots), np.nan)
    places = np.array(
        [
            shot.pose.transform(shot.arm.tool[np.newaxis, :2, 3])[0]
            if shot.arm
            else (np.nan, np.nan)
            for shot in shots
        ]
    )
    tools = np.array([shot.arm.tool[:3, 3] if shot.arm else np.full(3, np.nan) for shot in shots])
    moved = np.linalg.norm(np.diff(tools, axis=0, prepend=tools[:1]), axis=1)
    speed = moved / np.maximum(np.diff(samples.time, prepend=samples.time[0]), 1e-3)
    return replace(
        samples, x=places[:, 0], y=places[:, 1], speed=speed, true_x=unknown, true_y=unknown,
        commanded=unknown, health=unknown, deviation=unknown, error=unknown,
    )  # fmt: skip


def _nearest(shot: Snapshot) -> float:
    """Distance to the nearest thing that several beams hit, metres."""
    if shot.scan is None:
        return float("nan")
    ranges = np.sort(shot.scan.ranges[np.isfinite(shot.scan.ranges)])
    return float(ranges[NEAREST_BEAMS - 1]) if len(ranges) >= NEAREST_BEAMS else float("nan")


def _compute(shots: list[Snapshot]) -> FloatArray:
    """Milliseconds of a step, mean since they were recorded last; NaN if they never were."""
    totals = np.array([_total(shot) for shot in shots])
    steps = np.diff(totals[:, 1], prepend=0.0)
    spent = np.diff(totals[:, 0], prepend=0.0)
    told = np.flatnonzero(steps > 0)  # they are recorded less often than poses
    if not len(told):
        return np.full(len(shots), np.nan)
    found: FloatArray = np.interp(np.arange(len(shots)), told, 1e3 * spent[told] / steps[told])
    return found


def _total(shot: Snapshot) -> tuple[float, float]:
    timing = shot.stages.get("step")
    return (0.0, 0.0) if timing is None else (timing.mean * timing.count, float(timing.count))
