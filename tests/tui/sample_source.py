"""A run of an office patrol made of records alone: deterministic, no engine, no clock.

`SampleSource` is what the dashboard watches in its tests; it records every command it is given.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from missions.language.kinds import glyph_of
from missions.language.kinds.leaf import CONDITION_GLYPH
from stack.telemetry.records import (
    Ack,
    Command,
    Event,
    Layer,
    MissionState,
    RunInfo,
    Snapshot,
    StageTiming,
    TreeRow,
)
from stack.types import (
    Battery,
    Footprint,
    Marker,
    ParameterInfo,
    ParameterTable,
    Path,
    Pose2D,
    SensorState,
    Twist,
)
from tests.tui.sample_office import PLACES, build_office, look_around

PERIOD, CRUISE = 0.1, 0.5
ROUTE = np.array(
    [
        (1.6, 7.0), (3.1, 6.6), (3.1, 4.2), (3.2, 3.6), (3.1, 4.4), (3.2, 6.4), (8.6, 6.9),
        (9.9, 6.3),
        (9.9, 4.8), (10.0, 4.0), (9.9, 4.8), (10.0, 6.4), (13.0, 7.0), (16.3, 6.7), (16.9, 6.2),
        (17.0, 4.4),
    ]
)  # fmt: skip

MARKERS = tuple(
    Marker(number, 0.2, (x, y, 0.6), heading)
    for number, (x, y, heading) in enumerate(
        [(0.18, 7.0, 0.0), (8.0, 5.52, 1.57), (15.0, 8.38, -1.57), (13.72, 3.0, 0.0),
        (22.0, 8.38, 0.0)]
    )
)  # fmt: skip

INFO = RunInfo(
    "office_patrol-20260101-120000", "missions/02_office_patrol.yaml", "Office patrol", "rover",
    "office", 7, Footprint.circle(0.22), MARKERS, places=PLACES,
)  # fmt: skip

CRUISE_SPEED = "controller.cruise_speed"
PARAMETERS = {
    CRUISE_SPEED: 0.5, "controller.lookahead": 0.9, "localisation.particles": 500,
    "planner.allow_unknown": False, "world.note": "plain",
}  # fmt: skip

TABLE = ParameterTable((
    ParameterInfo(
        CRUISE_SPEED, "number in m/s", "m/s", "> 0", "speed on a free straight", True, 0.5
    ),
    ParameterInfo("controller.lookahead", "number in m", "m", "> 0", "length ahead", False, 0.9),
    ParameterInfo(
        "localisation.particles", "whole number", "", ">= 50", "number of particles", False, 400
    ),
    ParameterInfo(
        "planner.allow_unknown", "true or false", "", "", "plan through unknown cells", True, False
    ),
    ParameterInfo("world.note", "text", "", "", "free text", False, "plain"),
))  # fmt: skip

# (parent, name, kind, status, message, since)
TREE = (
    (-1, "office patrol", "reactive", "running", "", 0.0),
    (0, "battery guard", "fallback", "success", "", 0.0),
    (1, "charge above 25 %", "check", "success", "battery.charge (0.78) > 0.25", 0.0),
    (1, "return to dock", "navigate_to_pose", "idle", "", 0.0),
    (0, "rounds", "for_each", "running", "3 of 6: lab", 1.0),
    (4, "visit", "recover", "running", "attempt 2 of 3", 24.6),
    (5, "go and look", "sequence", "running", "", 31.2),
    (6, "go to lab", "navigate_to_pose", "running", "9.9 m left, 0.48 m/s", 31.2),
    (6, "wait for a free view", "timeout", "idle", "", 0.0),
    (8, "nobody near", "wait_until", "idle", "", 0.0),
    (6, "look", "take_picture", "idle", "", 0.0),
    (6, "report it", "say", "idle", "", 0.0),
    (5, "recovery", "round_robin", "success", "1 of 3", 31.1),
    (12, "clear costmaps", "clear_costmap", "success", "", 28.3),
    (12, "spin", "spin", "failure", "COLLISION_AHEAD: something stands 0.31 m ahead", 28.3),
    (12, "back up", "back_up", "success", "0.30 m", 31.1),
    (0, "watch the fit", "while", "running", "", 0.0),
    (16, "fit below 0.3", "check", "failure", "localisation.health (0.83) < 0.3", 0.0),
    (16, "find itself", "retry", "idle", "", 0.0),
    (18, "relocalise", "relocalise", "idle", "", 0.0),
    (18, "turn once", "spin", "idle", "", 0.0),
    (0, "home", "on_failure", "idle", "", 0.0),
    (21, "go to dock", "navigate_to_pose", "idle", "", 0.0),
    (21, "dock", "dock_to_marker", "idle", "", 0.0),
    (21, "say done", "say", "idle", "", 0.0),
)

EVENTS = (
    (0.0, "info", "mission", "started", "office patrol begins: 6 places, seed 7"),
    (0.6, "info", "localisation", "relocalised", "found itself at x 1.60, y 7.00, fit 0.91"),
    (1.0, "info", "tree", "node_status", "rounds: running"),
    (1.0, "info", "navigation", "goal", "goal kitchen, 5.4 m to drive"),
    (10.8, "info", "navigation", "arrived", "kitchen reached, 0.11 m off"),
    (12.4, "info", "navigation", "goal", "goal meeting_room, 10.7 m to drive"),
    (19.7, "warning", "safety", "slowed", "person 0.9 m ahead: slowed to 0.15 m/s"),
    (24.6, "error", "navigation", "failed", "NO_PROGRESS: 0.04 m in 5.0 s at x 9.92, y 6.31"),
    (24.6, "info", "tree", "recovery", "recovery 1 of 3: clear costmaps"),
    (28.3, "warning", "tree", "recovery", "spin failed: COLLISION_AHEAD, something at 0.31 m"),
    (31.1, "info", "tree", "recovery", "back up: 0.30 m"),
    (31.2, "info", "navigation", "replan", "new path to lab, 14.2 m, 31 ms"),
)  # fmt: skip


def shown_glyph(kind):
    """The glyph of a row, as its node states it."""
    return CONDITION_GLYPH if kind in ("check", "wait_until") else glyph_of(kind)


class SampleSource:
    """A patrol at any tick; tests move `tick`, set fields and look at `sent`."""

    def __init__(self, tick: int = 420) -> None:
        self.info: RunInfo | None = INFO
        self.silent_for = 0.1
        self.pictures = False
        self.report: Mapping[str, Any] | None = None
        self.is_over = False
        self.sent: list[Command] = []
        self.refusal = ""
        self.closed = False
        self.tick = tick
        self.changes: dict[str, Any] = {}
        self._acks: list[Ack] = []
        self._events_given = 0
        self._office = build_office()
        self._route = _resample(ROUTE, CRUISE * PERIOD)

    def poll(self) -> Snapshot | None:
        """The snapshot of the present tick, with `changes` applied; None while tick < 0."""
        return None if self.tick < 0 else replace(self._snapshot(self.tick), **self.changes)

    def events(self) -> list[Event]:
        """Events up to the present tick that were not given yet."""
        due = [row for row in EVENTS if row[0] <= self.tick * PERIOD]
        fresh = [
            Event(number, round(row[0] / 0.05), *row)
            for number, row in enumerate(due)
            if number >= self._events_given
        ]
        self._events_given = len(due)
        return fresh

    def send(self, command: Command) -> None:
        """Keep the command; answer it, refused when `refusal` says why."""
        self.sent.append(command)
        self._acks.append(Ack(command.id, not self.refusal, self.refusal))

    def acks(self) -> list[Ack]:
        """Answers since the last call."""
        given, self._acks = self._acks, []
        return given

    def close(self) -> None:
        """Remember that the dashboard let go."""
        self.closed = True

    def _snapshot(self, tick: int) -> Snapshot:
        rng = np.random.default_rng([7, tick])
        index = min(tick, len(self._route) - 2)
        truth = self._pose(index)
        pose = Pose2D(
            truth.x + 0.03 * np.sin(tick / 9), truth.y + 0.02 * np.cos(tick / 7), truth.heading
        )
        people = self._people(tick)
        spread = rng.normal(0.0, (0.16, 0.16, 0.05), (240, 3))
        speed = CRUISE * (1.0 - 0.7 * np.exp(-((((tick % 140) - 70) / 14.0) ** 2)))
        ahead = self._route[index:]
        return Snapshot(
            time=tick * PERIOD, step=tick * 2, state=MissionState.RUNNING, reason="",
            tree=_tree(tick * PERIOD), pose=pose, covariance=np.diag([9e-4, 4e-4, 1e-3]),
            health=float(0.83 + 0.06 * np.sin(tick / 23)), battery=Battery(0.90 - tick * 2.8e-4),
            particles=np.array([pose.x, pose.y, pose.heading]) + spread,
            scan=look_around(self._office.grid, pose, people),
            path=Path(np.column_stack([ahead, np.zeros(len(ahead))])),
            local_plan=Path(np.column_stack([ahead[:30], np.zeros(len(ahead[:30]))])),
            goal=Pose2D(*ROUTE[-1]),
            layers={"map": Layer(1, self._office.grid),
            "global_costmap": Layer(1, self._office.costs),
            "parameters": Layer(1, TABLE)},
            commanded=Twist(float(speed), 0.12),
            measured=Twist(float(speed + rng.normal(0.0, 0.012)), 0.10),
            stages={
                "estimate": StageTiming(0.0021, 0.0064, tick, 0, 0.0020, 0.0051),
                "costmap": StageTiming(0.0014, 0.0031, tick, 0, 0.0013, 0.0027),
                "tree": StageTiming(0.0002, 0.0009, tick),
                "navigate": StageTiming(0.0058, 0.0812, tick, 2, 0.0052, 0.0503),
                "safety": StageTiming(0.0003, 0.0005, tick),
                "body": StageTiming(0.0041, 0.0102, tick),
            },
            sensors=(
                SensorState("lidar", 9.8, 10.0, 0.05), SensorState("sonar_left", 3.0, 10.0, 0.2),
                SensorState("imu", 0.0, 100.0, 4.2), SensorState("wheels", 20.0, 0.0, 0.05),
            ),
            memory=312e6, speed=8.2, truth=truth, people=people,
            counters={
                "recoveries": 1.0, "replans": 7.0, "collisions": 0.0,
                "distance": tick * CRUISE * PERIOD,
                "clearance": 0.31,
            },
            parameters=PARAMETERS,
        )  # fmt: skip

    def _pose(self, index: int) -> Pose2D:
        (x, y), (next_x, next_y) = self._route[index], self._route[index + 1]
        return Pose2D(float(x), float(y), float(np.arctan2(next_y - y, next_x - x)))

    def _people(self, tick: int) -> np.ndarray:
        return np.array(
            [
                (14.5 + 2.0 * np.sin(tick / 40), 7.7, 0.25),
                (19.5, 7.0 + 0.8 * np.cos(tick / 30), 0.25),
                (11.9, 3.6, 0.25),
            ]
        )


def _tree(now: float) -> tuple[TreeRow, ...]:
    return tuple(
        TreeRow(number, parent, name, kind, status, message, min(since, now), shown_glyph(kind))
        for number, (parent, name, kind, status, message, since) in enumerate(TREE)
    )


def _resample(corners: np.ndarray, spacing: float) -> np.ndarray:
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    along = np.arange(0.0, lengths[-1], spacing)
    return np.column_stack([np.interp(along, lengths, corners[:, axis]) for axis in (0, 1)])


def finished(source: SampleSource, state: MissionState, reason: str = "") -> None:
    """Let the source's run be over."""
    ended = "success" if state is MissionState.SUCCESS else "failure"
    rows = tuple(
        replace(row, status=ended if row.status == "running" else row.status)
        for row in _tree(source.tick * PERIOD)
    )
    source.changes.update(
        state=state, reason=reason, tree=rows, commanded=Twist(), measured=Twist()
    )
    source.report, source.is_over = {"outcome": str(state)}, True
