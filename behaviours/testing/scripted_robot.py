"""A robot of plain attributes that tests of behaviours set, and the tasks that it returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from inspect import signature
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar, cast

import numpy as np

from behaviours.testing.scripted_arm import ScriptedArm, ScriptedGripper
from behaviours.testing.scripted_task import ScriptedTask
from stack.errors import NavigationError, ParameterError
from stack.robot import Base, JsonValue, Localisation, Map, Perception, Robot, Task
from stack.types import (
    STANDSTILL,
    Battery,
    Block,
    ContactZone,
    CoveragePlan,
    Detection,
    FailureCode,
    FloatArray,
    FloorLines,
    Footprint,
    Frontier,
    Image,
    LineColour,
    Marker,
    MarkerSighting,
    Measurement,
    ObjectColour,
    OccupancyGrid,
    PlaceSighting,
    PointCloud,
    Pose2D,
    PoseEstimate,
    RivalPose,
    Scan,
    StandingObject,
    TaskStatus,
    TrackedObject,
    Twist,
)


def _no_fit(pose: Pose2D) -> float:
    return 0.0


M = TypeVar("M", bound=Measurement)
P = ParamSpec("P")

CAPABILITIES = (Base, Localisation, Map, Perception)


class _Asked:
    """A scripted robot, but only what one protocol of stack.robot promises."""

    def __init__(self, robot: ScriptedRobot, protocol: type, words: str) -> None:
        self._robot, self._words = robot, words
        self._names = {name for name in vars(protocol) if not name.startswith("_")}

    def __getattr__(self, name: str) -> Any:
        if name in self._names:
            return getattr(self._robot, name)
        elsewhere = [
            f"; it is robot.{protocol.__name__.lower()}.{name}"
            for protocol in CAPABILITIES if name in vars(protocol)
        ]  # fmt: skip
        raise AttributeError(f"{self._words} has no {name!r}{''.join(elsewhere)}")


def _begins(
    call: Callable[Concatenate[Any, P], Task], *, moves: bool = True
) -> Callable[Concatenate[ScriptedRobot, P], ScriptedTask]:
    """Return a call of a protocol as the scripted robot answers it: recorded, with a new task."""
    form = signature(call)

    def begin(robot: ScriptedRobot, /, *args: P.args, **kwargs: P.kwargs) -> ScriptedTask:
        call_of_robot = form.bind(robot, *args, **kwargs)
        call_of_robot.apply_defaults()
        _, *arguments = call_of_robot.arguments.items()
        start = robot._move if moves else robot._request
        return start(call.__name__, **dict(arguments))

    return begin


@dataclass
class ScriptedRobot:
    """A robot of plain attributes.

    A behaviour sees it as a stack.robot.Robot: what the test sets as `robot.pose` is
    `robot.localisation.pose` there. The test sets what the behaviour reads:
    `robot.battery = Battery(0.1)`. Every call of the behaviour is recorded in `calls` as
    (name, arguments). Those that begin something return a new task, `task`; the test ends it:
    `robot.task.succeed(path)`. Motions have failed with LOST if the robot is lost.

    Attributes:
        picture: returned by `image()`.
        cloud: returned by `point_cloud()`.
        sightings: returned by `marker_sightings()`.
        keyframes: of the map.
        seen_places: returned by `place_sightings()`.
        lines: returned by `floor_lines()`.
        objects: returned by `coloured_objects()`, those of the colour, and by `detections()`.
        seen_blocks: returned by `blocks()`.
        hand_camera: name of a depth camera in the hand.
        closer: returned by `look_closer()`.
        gone_blocks: those for which `is_gone` answers yes.
        tracks: moving objects.
        standing_objects: not on the map, and have not moved.
        fit: called by `fit_at()`.
        covariance: (3, 3) of x, y, heading, in `estimate`.
        rivals: other poses that explain the scans as well, in `estimate`.
        said: messages for the operator.
        twist: last velocity of `drive_for`.
        contact: where that one may touch something.
        gives_way: whether that one leaves the way of people.
        calls: all calls in order.
        task: the newest task; the test sets its outcome.
        motion: the newest motion task; a newer one cancels it.
        edges: ids of the edges of the route graph.
        grid: the map so far.
        known_area: square metres.
        recording_over: whether a replayed log is over.
        held_by: returned by `held()`, whatever the time.
        frontier_list: returned by `frontiers()`.
        lanes: returned by `coverage()`.
        measurements: returned by `newest()`, by the name of the sensor.
    """

    time: float = 0.0
    pose: Pose2D = Pose2D(0.0, 0.0)
    odometry: Pose2D = Pose2D(0.0, 0.0)
    health: float = 1.0
    covariance: FloatArray = field(default_factory=lambda: np.diag([0.0025, 0.0025, 0.001]))
    rivals: tuple[RivalPose, ...] = ()
    speed: Twist = STANDSTILL
    footprint: Footprint = field(default_factory=lambda: Footprint.circle(0.22))
    battery: Battery = field(default_factory=lambda: Battery(1.0))
    scan: Scan | None = None
    markers: tuple[Marker, ...] = ()
    picture: Image | None = None
    cloud: PointCloud | None = None
    sightings: tuple[MarkerSighting, ...] = ()
    tracks: tuple[TrackedObject, ...] = ()
    standing_objects: tuple[StandingObject, ...] = ()
    keyframes: int = 0
    seen_places: tuple[PlaceSighting, ...] = ()
    lines: FloorLines | None = None
    objects: tuple[Detection, ...] | None = None
    seen_blocks: tuple[Block, ...] | None = None
    gone_blocks: tuple[Block, ...] = ()
    hand_camera: str = ""
    closer: Block | None = None
    fit: Callable[[Pose2D], float] = _no_fit
    said: list[str] = field(default_factory=list)
    twist: Twist = STANDSTILL
    contact: ContactZone | None = None
    gives_way: bool = False
    calls: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    task: ScriptedTask = field(default_factory=ScriptedTask)
    motion: ScriptedTask = field(default_factory=ScriptedTask)
    edges: tuple[str, ...] = ()
    grid: OccupancyGrid = field(
        default_factory=lambda: OccupancyGrid(np.zeros((1, 1), np.int8), 0.1)
    )
    known_area: float = 0.0
    held_by: str = ""
    recording_over: bool = False
    frontier_list: list[Frontier] = field(default_factory=list)
    lanes: CoveragePlan = field(default_factory=lambda: CoveragePlan((), np.zeros((0, 2)), 0.1))
    measurements: dict[str, Measurement] = field(default_factory=dict)
    _driven: ScriptedTask = field(default_factory=lambda: ScriptedTask(TaskStatus.SUCCEEDED))
    _driven_until: float = 0.0

    @cached_property
    def arm(self) -> ScriptedArm:
        """Its arm; the test sets its attributes."""
        return ScriptedArm(self._request)

    @cached_property
    def gripper(self) -> ScriptedGripper:
        """Its gripper; the test sets its attributes."""
        return ScriptedGripper(self._request)

    @cached_property
    def interface(self) -> Robot:
        """The robot as behaviours see it."""
        return cast("Robot", _Asked(self, Robot, "robot"))

    @cached_property
    def base(self) -> Base:
        """What behaviours may ask of the drive; likewise the next three."""
        return cast("Base", _Asked(self, Base, "robot.base"))

    @cached_property
    def localisation(self) -> Localisation:
        return cast("Localisation", _Asked(self, Localisation, "robot.localisation"))

    @cached_property
    def map(self) -> Map:
        return cast("Map", _Asked(self, Map, "robot.map"))

    @cached_property
    def perception(self) -> Perception:
        return cast("Perception", _Asked(self, Perception, "robot.perception"))

    def advance(self, seconds: float) -> None:
        """Advance the clock. A subclass can override this to move the robot."""
        self.time = round(self.time + seconds, 9)
        if self.time >= self._driven_until and self._driven.status is TaskStatus.RUNNING:
            self._driven.succeed()

    def calls_of(self, name: str) -> list[dict[str, Any]]:
        """Return the arguments of every call with this name, in order."""
        return [arguments for called, arguments in self.calls if called == name]

    @property
    def estimate(self) -> PoseEstimate:
        """The pose estimate: pose, covariance, health and rivals."""
        return PoseEstimate(self.pose, self.covariance, self.health, rivals=self.rivals)

    def frontiers(
        self, *, sensor_range: float = 6.0, least_size: float = 0.4, least_gain: float = 0.25,
        avoided: Sequence[Pose2D] = (), seen_from: Sequence[Pose2D] | None = None,
    ) -> list[Frontier]:  # fmt: skip
        return list(self.frontier_list)

    def coverage(
        self, corners: list[Pose2D], spacing: float, *, clearance: float | None = None
    ) -> CoveragePlan:
        self._record("coverage", corners=corners, spacing=spacing, clearance=clearance)
        return self.lanes

    def save(self, name: str) -> str:
        """Record the call; return the name."""
        self._record("save", name=name)
        return name

    def load(self, name: str, pose: Pose2D | None = None) -> None:
        self._record("load", name=name, pose=pose)

    def set_mapping(self, is_mapping: bool) -> None:
        self._record("set_mapping", is_mapping=is_mapping)

    def image(self) -> Image | None:
        return self.picture

    def point_cloud(
        self, camera: str = "", *, voxel: float = 0.05, above: float | None = None
    ) -> PointCloud | None:
        """Return `cloud`, without the points up to `above`."""
        if self.cloud is None or above is None:
            return self.cloud
        return replace(self.cloud, points=self.cloud.points[self.cloud.points[:, 2] > above])

    def newest(self, name: str, kind: type[M]) -> M | None:
        measurement = self.measurements.get(name)
        return measurement if isinstance(measurement, kind) else None

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        return self.sightings

    def place_sightings(self) -> tuple[PlaceSighting, ...]:
        return self.seen_places

    def floor_lines(self, colour: LineColour, width: float) -> FloorLines | None:
        return self.lines

    def coloured_objects(self, colour: ObjectColour) -> tuple[Detection, ...] | None:
        return self.detections(colour)

    def blocks(self, camera: str = "") -> tuple[Block, ...] | None:
        return self.seen_blocks

    def look_closer(self, block: Block, since: float) -> Block | None:
        return self.closer

    def is_gone(self, block: Block, camera: str = "") -> bool:
        return any(block is lost for lost in self.gone_blocks)

    def detections(self, label: str | None = None) -> tuple[Detection, ...] | None:
        if self.objects is None:
            return None
        return tuple(item for item in self.objects if label in (None, item.label))

    def held(self, since: float) -> str:
        return self.held_by

    def fit_at(self, pose: Pose2D) -> float:
        return self.fit(pose)

    plan = _begins(Base.plan, moves=False)
    relocalise = _begins(Localisation.relocalise, moves=False)
    navigate_to = _begins(Base.navigate_to)
    navigate_through = _begins(Base.navigate_through)
    follow_path = _begins(Base.follow_path)
    spin = _begins(Base.spin)
    back_up = _begins(Base.back_up)
    drive_on_heading = _begins(Base.drive_on_heading)
    escape = _begins(Base.escape)
    assisted_teleop = _begins(Base.assisted_teleop)
    disambiguate = _begins(Base.disambiguate)

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> ScriptedTask:  # fmt: skip
        """Store the velocity in `twist`; cancel the motion task, as the real robot does.

        Raises:
            NavigationError: LOST, if the robot is lost, as the real robot does.
        """
        if self.estimate.is_lost and not while_lost and twist != STANDSTILL:
            raise NavigationError(FailureCode.LOST, "the robot is lost")
        self.motion.cancel()
        self.twist, self.contact = twist, contact
        self.gives_way = gives_way
        self._record("drive_for", twist=twist, seconds=seconds)
        if self._driven.status is not TaskStatus.RUNNING:
            self._driven = ScriptedTask()
        self._driven_until = self.time + seconds
        return self._driven

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        options = {"radius": radius, "layer": layer}
        rest = {name: value for name, value in options.items() if value is not None}
        self._record("clear_costmap", which=which, **rest)

    def set_edge(self, edge: str, *, closed: bool) -> None:
        """Record the call. Raises ParameterError for an edge that is not in `edges`."""
        if edge not in self.edges:
            raise ParameterError("edge", f"the route graph has no edge {edge!r}")
        self._record("set_edge", edge=edge, closed=closed)

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        """Set `pose`, give up the rivals and record the call."""
        self.pose, self.rivals = pose, ()
        self._record(
            "set_pose", pose=pose, position_deviation=position_deviation,
            heading_deviation=heading_deviation, source=source,
        )  # fmt: skip

    def save_image(
        self, image: Image, name: str, *, details: Mapping[str, JsonValue] | None = None
    ) -> str:
        """Record the call; return the path that a real robot would use."""
        given = {} if details is None else {"details": details}
        self._record("save_image", image=image, name=name, **given)
        return f"images/{name}.png"

    def say(self, text: str) -> None:
        self.said.append(text)
        self._record("say", text=text)

    def _move(self, name: str, *, while_lost: bool = True, **arguments: Any) -> ScriptedTask:
        self.motion.cancel()
        self._driven.cancel()
        self.motion = self._request(name, **arguments)
        if self.estimate.is_lost and not while_lost:
            self.motion.fail(FailureCode.LOST, "the robot is lost")
        return self.motion

    def _request(self, called: str, **arguments: Any) -> ScriptedTask:
        self._record(called, **arguments)
        self.task = ScriptedTask()
        return self.task

    def _record(self, called: str, **arguments: Any) -> None:
        self.calls.append((called, arguments))


if TYPE_CHECKING:  # checked by the type checker: it has all that they promise
    _robot: Robot = ScriptedRobot()
    _base: Base = ScriptedRobot()
    _localisation: Localisation = ScriptedRobot()
    _map: Map = ScriptedRobot()
    _perception: Perception = ScriptedRobot()
