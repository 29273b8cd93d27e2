"""The records that leave the engine (Event, Snapshot) and the one that enters it (Command)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol, runtime_checkable

from stack.types import (
    STANDSTILL,
    Battery,
    CostGrid,
    FloatArray,
    Footprint,
    Image,
    Marker,
    OccupancyGrid,
    Path,
    Pose2D,
    Scan,
    TrackedObject,
    Twist,
)

ROUTINE = frozenset({"pose", "node_status", "tree", "teleop"})
"""Kinds of events that come all the time: for machines and records, not for people's eyes."""


class MissionState(StrEnum):
    """A mission in one word."""

    STARTING = "starting"
    RUNNING = "running"
    PAUSED = "paused"
    EMERGENCY_STOP = "emergency stop"
    SUCCESS = "success"
    FAILURE = "failure"
    ABORTED = "aborted"
    INTERRUPTED = "interrupted"
    ERROR = "error"

    @property
    def is_over(self) -> bool:
        """Whether nothing will change any more."""
        return self in _OVER


_OVER = frozenset(
    {
        MissionState.SUCCESS,
        MissionState.FAILURE,
        MissionState.ABORTED,
        MissionState.INTERRUPTED,
        MissionState.ERROR,
    }
)


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened. Numbered without gaps, lossless, hashed: no wall-clock figures.

    Attributes:
        number: from 0.
        step: runtime step in which it happened.
        time: seconds on the robot's clock.
        level: info | warning | error.
        source: who says so: mission, navigation, localisation, safety, command, tree, sim…
        kind: a stable word for machines: node_status, recovery, replan, relocalised, pose…
        text: a sentence for people; no absolute paths, no traceback.
        fields: JSON-compatible details (numbers, text, lists).
    """

    number: int
    step: int
    time: float
    level: str
    source: str
    kind: str
    text: str
    fields: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class TreeRow:
    """One node of the tree, in drawing order (depth first).

    Attributes:
        id: number, stable as long as the tree is not replaced.
        parent: id of the parent, -1 at the root.
        name: label.
        kind: the word of the mission file: sequence, navigate_to_pose, retry…
        status: running | success | failure | idle.
        message: what it says about itself, or why it failed.
        since: robot time of the last change of status.
    """

    id: int
    parent: int
    name: str
    kind: str
    status: str
    message: str = ""
    since: float = 0.0


@dataclass(frozen=True, slots=True)
class Debugging:
    """What operators do to the tree while it runs.

    Attributes:
        breakpoints: ids of the nodes that the mission stops before.
        held: ids of the nodes that it stopped before and that start with the next tick.
        forced: success | failure by id, as text.
        generation: how often the tree was replaced by that of a file saved meanwhile.
        faults: what is wrong with the file as last saved, which was therefore not taken.
    """

    breakpoints: tuple[int, ...] = ()
    held: tuple[int, ...] = ()
    forced: Mapping[str, str] = field(default_factory=dict)
    generation: int = 0
    faults: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StageTiming:
    """Compute time of one stage of the loop, wall seconds."""

    mean: float
    worst: float
    count: int
    overruns: int = 0


@dataclass(frozen=True, slots=True)
class SceneShape:
    """A thing to draw: box (size length, width, height) or cylinder (size diameter ×2, height).

    The pose is of its middle on the floor; `lift` is the height of its underside.
    """

    kind: str
    pose: Pose2D
    size: tuple[float, float, float]
    colour: tuple[float, float, float]
    lift: float = 0.0


@dataclass(frozen=True, slots=True)
class Layer:
    """A large thing that changes seldom, with a version that grows when it does."""

    version: int
    content: OccupancyGrid | CostGrid | tuple[SceneShape, ...]


@dataclass(frozen=True, slots=True)
class RunInfo:
    """What is fixed for a run; every sink gets it when it opens.

    Attributes:
        run_id: name of the run's folder, e.g. office_patrol-20261120-235959.
        urdf: text of the robot's URDF, for 3-D views.
        versions: package -> version.
    """

    run_id: str
    mission: str
    title: str
    robot: str
    world: str
    seed: int
    footprint: Footprint
    markers: tuple[Marker, ...] = ()
    urdf: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    places: Mapping[str, Pose2D] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One moment of a run. Latest wins; layers are sent when their version changes.

    Attributes:
        time: robot's clock, seconds.
        step: runtime step.
        state: the mission in one word; `reason` says why (the path to the first failure, the
            breakpoint).
        tree: rows in drawing order.
        pose: estimate, map frame; covariance (3, 3); health in [0, 1].
        odometry: pose in the odom frame.
        particles: (n, 3) float32 x, y, heading of at most 500 particles, map frame.
        scan: newest scan (base frame through its mount; draw it at `pose`).
        path: global plan in force; local_plan what the controller means to do next.
        layers: map, global_costmap, local_costmap, scene by name.
        commanded / measured: velocities.
        stages: compute time by stage name.
        speed: simulated seconds per wall second so far.
        pace: the same as asked for; 0 is as fast as the machine can.
        parameters: component parameters in force, flat: "controller.cruise_speed" -> value.
        image: newest camera picture if one came since the last snapshot.
        truth: the true pose, in simulation only. people: (n, 3) x, y, radius, likewise.
        tracks: what moves, as the robot follows it, map frame; empty when nobody asks for it.
        blackboard: key -> value as text.
        counters: recoveries, replans, collisions, distance (m)…
        teleop: the operator may drive, by `teleop` commands.
        safety: what the safety stage does now, in words; empty when nothing.
        events: the last few events, oldest first.
        debugging: breakpoints, forced outcomes, what became of a file saved meanwhile.
    """

    time: float
    step: int
    state: MissionState
    reason: str
    tree: tuple[TreeRow, ...]
    pose: Pose2D
    covariance: FloatArray
    health: float
    battery: Battery
    odometry: Pose2D = Pose2D(0.0, 0.0)
    particles: FloatArray | None = None
    scan: Scan | None = None
    path: Path | None = None
    local_plan: Path | None = None
    goal: Pose2D | None = None
    layers: Mapping[str, Layer] = field(default_factory=dict)
    commanded: Twist = STANDSTILL
    measured: Twist = STANDSTILL
    stages: Mapping[str, StageTiming] = field(default_factory=dict)
    speed: float = 0.0
    pace: float = 0.0
    parameters: Mapping[str, Any] = field(default_factory=dict)
    image: Image | None = None
    truth: Pose2D | None = None
    people: FloatArray | None = None
    blackboard: Mapping[str, str] = field(default_factory=dict)
    counters: Mapping[str, float] = field(default_factory=dict)
    teleop: bool = False
    safety: str = ""
    events: tuple[Event, ...] = ()
    tracks: tuple[TrackedObject, ...] = ()
    debugging: Debugging = Debugging()


@dataclass(frozen=True, slots=True)
class Command:
    """Something an operator wants, applied between two steps.

    Attributes:
        id: chosen by the sender; comes back in the Ack.
        kind: pause | resume | abort | estop | release | speed | set_pose | set_goal |
            set_parameter | teleop (a velocity, driven for half a second of the robot's clock, while
            the behaviour assisted_teleop runs) | teleop_done | break | unbreak | step | continue |
            force.
        arguments: e.g. {"factor": 4.0}, {"x": 1.0, "y": 2.0, "heading": 0.0},
            {"name": "controller.cruise_speed", "value": 0.4}, {"reason": "…"},
            {"linear": 0.2, "angular": -0.4, "lateral": 0.0}, {"ticks": 1}, {"node": "12",
            "generation": 0}, {"node": "go to lab", "status": "failure", "code": "NO_VALID_PATH"}.
    """

    id: str
    kind: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Ack:
    """What became of a command: done, or refused with a reason.

    Attributes:
        reason: why it was refused; what was understood, when that needs words.
    """

    id: str
    done: bool
    reason: str = ""


class Sink(Protocol):
    """Something fed by the two streams: recorder, rerun, ZeroMQ server, MAVLink, progress lines.

    All calls come from the engine's own thread. A sink that fails is dropped with a warning; it
    never takes the mission down.
    """

    def open(self, info: RunInfo) -> None:
        """The run begins."""
        ...

    def event(self, event: Event) -> None:
        """Something happened: called for each event, in order."""
        ...

    def wants_snapshot(self, time: float) -> bool:
        """Whether a snapshot at this robot time would be used; must be cheap."""
        ...

    def snapshot(self, snapshot: Snapshot) -> None:
        """A moment that `wants_snapshot` asked for. The last one of a run always comes."""
        ...

    def close(self, report: Mapping[str, Any] | None) -> None:
        """The run is over; `report` is what goes into report.json (None after a crash)."""
        ...


@runtime_checkable
class CommandSource(Protocol):
    """A sink that also listens to operators."""

    def service(self) -> None:
        """Answer who is connected; called often while nothing else happens. Never blocks."""
        ...

    def commands(self) -> list[Command]:
        """What came in since the last call, in order."""
        ...

    def acknowledge(self, ack: Ack) -> None:
        """Tell the sender of a command what became of it."""
        ...
