"""The records that leave the engine (Event, Snapshot) and the one that enters it (Command)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any
from uuid import uuid4

from stack.mavlink.origin import GeoOrigin
from stack.types import (
    STANDSTILL,
    ArmView,
    Battery,
    CameraState,
    ColourMask,
    CostGrid,
    DepthImage,
    Detection,
    FloatArray,
    Footprint,
    HealthThresholds,
    Image,
    Limitation,
    LoopStatistics,
    Marker,
    OccupancyGrid,
    ParameterTable,
    Path,
    Pose2D,
    RivalPose,
    Scan,
    SensorState,
    TrackedObject,
    Twist,
)

ROUTINE = frozenset({"pose", "node_status", "tree", "teleop"})
"""Kinds of frequent events that are recorded but not shown to people."""


STALE_AFTER, OLD_SCAN = "safety.stale_after", 0.5
"""Parameter with the age above which the robot does not drive by a scan; that age without it, s."""


def new_identity() -> str:
    """Return the identity of a new run: 32 hexadecimal digits that no other run has."""
    return uuid4().hex


class MissionState(StrEnum):
    """State of a mission."""

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
        """Whether the state is final."""
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
    """One event. Numbered without gaps, lossless and hashed: it has no wall-clock figures.

    Attributes:
        number: counts from 0.
        step: runtime step in which it happened.
        time: seconds on the robot's clock.
        level: info | warning | error.
        source: part that emitted it: mission, navigation, localisation, safety, command, tree, sim…
        kind: a stable word for machines: node_status, recovery, replan, relocalised, pose…
        text: a sentence for people, without absolute paths or tracebacks.
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
        kind: the word in the mission file: sequence, navigate_to_pose, retry…
        status: running | success | failure | idle.
        message: progress of the node, or why it failed.
        since: robot time of the last change of status, seconds.
        glyph: character of its kind.
    """

    id: int
    parent: int
    name: str
    kind: str
    status: str
    message: str = ""
    since: float = 0.0
    glyph: str = "⚙"


@dataclass(frozen=True, slots=True)
class Debugging:
    """State of debugging: breakpoints, forced outcomes and reloads of the mission file.

    Attributes:
        breakpoints: ids of the nodes with a breakpoint.
        held: ids of the nodes at which the mission stopped; they start with the next tick.
        forced: forced status (success | failure) by node id.
        generation: number of reloads of the mission file so far.
        faults: errors in the changed mission file, which was therefore not loaded.
    """

    breakpoints: tuple[int, ...] = ()
    held: tuple[int, ...] = ()
    forced: Mapping[str, str] = field(default_factory=dict)
    generation: int = 0
    faults: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StageTiming:
    """Compute time of one stage of the loop in wall seconds, number of runs and overruns.

    Attributes:
        median: of the last runs.
        slow: 99 % of the last runs took no longer.
        budget: a run that takes longer counts as an overrun.
    """

    mean: float
    worst: float
    count: int
    overruns: int = 0
    median: float = 0.0
    slow: float = 0.0
    budget: float = 0.05


AROUND_ARM = "around_arm"
"""Layer of the boxes and blocks that an arm knows."""


@dataclass(frozen=True, slots=True)
class SceneShape:
    """A shape to draw.

    Attributes:
        kind: box | cylinder.
        pose: of its centre on the floor.
        size: length, width, height of a box; diameter, diameter, height of a cylinder; metres.
        colour: red, green, blue in [0, 1].
        lift: height of its underside, metres.
    """

    kind: str
    pose: Pose2D
    size: tuple[float, float, float]
    colour: tuple[float, float, float]
    lift: float = 0.0


@dataclass(frozen=True, slots=True)
class Layer:
    """A large record that changes rarely; its version grows with each change.

    Attributes:
        changes: the last changes of a grid without a gap, oldest first: the version after the
            change, and the changed rows and columns as (first row, row after the last, first
            column, column after the last). Not sent to clients.
    """

    version: int
    content: OccupancyGrid | CostGrid | tuple[SceneShape, ...] | ParameterTable
    changes: tuple[tuple[int, tuple[int, int, int, int]], ...] = field(
        default=(), compare=False, metadata={"sent": False}
    )


@dataclass(frozen=True, slots=True)
class RunInfo:
    """Constant data of a run; every sink receives it when it opens.

    Attributes:
        run_id: name of the run's folder, e.g. office_patrol-20261120-235959.
        urdf: text of the robot's URDF, for 3-D views.
        places: named poses, map frame.
        identity: of this run alone; two runs may have the same name.
        drives: whether the robot's base moves.
        origin: place of the map frame's origin on Earth; None: unknown.
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
    places: Mapping[str, Pose2D] = field(default_factory=dict)
    identity: str = field(default_factory=new_identity)
    origin: GeoOrigin | None = None
    drives: bool = True


@dataclass(frozen=True, slots=True)
class Snapshot:
    """State of a run at one time. The latest wins; layers are sent when their version changes.

    Attributes:
        time: robot's clock, seconds.
        step: runtime step.
        state: state of the mission.
        reason: why it is in this state: the path to the first failure, or the breakpoint.
        tree: rows in drawing order.
        pose: estimate, map frame.
        covariance: (3, 3) of x, y, heading of the estimate.
        health: of the localisation, in [0, 1].
        rivals: other poses that explain the measurements about as well, most probable first.
        odometry: pose in the odom frame.
        particles: (n, 3) float32 x, y, heading of at most 500 particles, map frame.
        scan: newest scan (in the base frame through its mount; draw it at `pose`).
        path: current global plan, map frame.
        local_plan: what the controller plans to drive next, map frame.
        layers: map, global_costmap, local_costmap, scene, parameters (what they are) by name.
        commanded: velocity sent to the body.
        measured: velocity measured by odometry.
        stages: compute time by stage name.
        speed: robot seconds per wall second in the last 5 s, without holds.
        pace: requested simulated seconds per wall second; 0: as fast as possible.
        parameters: current component parameters, flat: "controller.cruise_speed" -> value.
        image: newest camera picture. Pictures are not sent to dashboards.
        truth: true pose, in simulation only.
        people: (n, 3) x, y, radius of the people, in simulation only.
        tracks: tracked moving objects, map frame; empty when no component needs tracks.
        blackboard: key -> value as text.
        counters: recoveries, replans, collisions, distance (m)…
        teleop: whether the operator may drive with `teleop` commands.
        detour: whether the robot drives to the operator's goal, or carries out the operator's
            behaviour, while the mission is paused.
        detour_held: whether that is paused too; `resume` continues it.
        limitations: why safety stage and doubt about the pose limit the velocity now.
        events: the last few events, oldest first.
        debugging: breakpoints, forced outcomes and reloads.
        records_lost: files of the run folder that cannot be written, as text; empty if none.
        detections: objects in recent pictures, map frame.
        mask: pixels of the colour in the newest picture that was searched.
        cameras: state of every camera of the robot.
        sensors: how often each sensor delivers.
        memory: of the engine, bytes; 0: unknown.
        fast_loop: timing of the process that holds the hardware; None without one.
        arm: its joints, tool and gripper; None without an arm.
        depth_points: (n, 3) float32 of at most 1500 obstacles from depth cameras, map frame; z is 0
            where the floor is missing. None while no depth camera is used.
        depth_image: newest picture of a depth camera.
        localisation_fault: what the estimator does without now, and why; empty if nothing.
        health_thresholds: below which health the robot is lost, from which on the pose is good.
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
    rivals: tuple[RivalPose, ...] = ()
    truth: Pose2D | None = None
    people: FloatArray | None = None
    blackboard: Mapping[str, str] = field(default_factory=dict)
    counters: Mapping[str, float] = field(default_factory=dict)
    teleop: bool = False
    detour: bool = False
    detour_held: bool = False
    limitations: tuple[Limitation, ...] = ()
    events: tuple[Event, ...] = ()
    tracks: tuple[TrackedObject, ...] = ()
    debugging: Debugging = Debugging()
    records_lost: str = ""
    localisation_fault: str = ""
    health_thresholds: HealthThresholds = field(default_factory=HealthThresholds)
    detections: tuple[Detection, ...] = ()
    mask: ColourMask | None = None
    cameras: tuple[CameraState, ...] = ()
    sensors: tuple[SensorState, ...] = ()
    memory: float = 0.0
    depth_points: FloatArray | None = None
    depth_image: DepthImage | None = None
    fast_loop: LoopStatistics | None = None
    arm: ArmView | None = None

    @property
    def safety(self) -> str:
        """Why the velocity is limited now, for people; empty if it is not."""
        return "; ".join(limitation.text for limitation in self.limitations)

    @property
    def old_scan(self) -> float:
        """Age of the newest scan, seconds, if it is too old to drive by; 0 otherwise."""
        age = 0.0 if self.scan is None else self.time - self.scan.stamp
        return age if age > float(self.parameters.get(STALE_AFTER, OLD_SCAN)) else 0.0


@dataclass(frozen=True, slots=True)
class Command:
    """A command of an operator, applied between two steps.

    Attributes:
        id: chosen by the sender; returned in the Ack.
        kind: pause | resume | abort | estop | release | speed | set_pose | set_goal |
            cancel_goal | behaviour | set_parameter | teleop (a velocity for half a second of the
            robot's clock, while the behaviour assisted_teleop runs) | teleop_done | break |
            unbreak | step | continue | force.
        arguments: e.g. {"factor": 4.0}, {"x": 1.0, "y": 2.0, "heading": 0.0},
            {"name": "controller.cruise_speed", "value": 0.4}, {"reason": "…"},
            {"linear": 0.2, "angular": -0.4, "lateral": 0.0}, {"ticks": 1}, {"node": "12",
            "generation": 0}, {"node": "go to lab", "status": "failure", "code": "NO_VALID_PATH"}.
        run: identity of the run that it is meant for; `TelemetryClient` fills it in.
    """

    id: str
    kind: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    run: str = ""


@dataclass(frozen=True, slots=True)
class Ack:
    """Acknowledgement of a command: done, or refused with a reason.

    Attributes:
        id: of the command.
        done: whether it was applied.
        reason: why it was refused; or, for some commands, what was done.
    """

    id: str
    done: bool
    reason: str = ""
