"""Components: planners, controllers and costmap layers, chosen by name and extensible by plugins.

A component class inherits the base class of its kind, which gives defaults for what is optional. It
has a class attribute `Parameters` (a frozen dataclass of `parameter(...)` fields) and a docstring
whose first line describes it. Its module must not import numba, cv2 or its kernels at module level
but in `__init__`, so that checking a mission imports none of them. Plugins register classes in the
entry-point groups of `GROUPS`. Layers inherit `Layer` of
stack/costmap/layer.py.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any, ClassVar

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, NavigationError, ParameterError
from stack.parameters import build, suggestion
from stack.types import (
    CostGrid,
    FailureCode,
    FloatArray,
    Footprint,
    Path,
    Pose2D,
    TrackedObject,
    Twist,
)

BUILT_IN: dict[str, dict[str, str]] = {
    "planner": {
        "astar": "stack.planning.astar:Astar",
        "theta_star": "stack.planning.theta_star.planner:ThetaStar",
        "hybrid_astar": "stack.planning.kinematic.hybrid_astar:HybridAstar",
        "lattice": "stack.planning.kinematic.lattice:Lattice",
        "route": "stack.planning.routes.planner:Route",
    },
    "controller": {
        "pure_pursuit": "stack.control.pure_pursuit:PurePursuit",
        "mppi": "stack.control.mppi.controller:Mppi",
        "dwb": "stack.control.dwb.controller:Dwb",
        "graceful": "stack.control.graceful:Graceful",
    },
    "costmap_layer": {
        "static": "stack.costmap.static_layer:StaticLayer",
        "obstacle": "stack.costmap.obstacle_layer:ObstacleLayer",
        "range": "stack.costmap.range_layer:RangeLayer",
        "denoise": "stack.costmap.denoise_layer:DenoiseLayer",
        "keepout": "stack.costmap.zone_layers:KeepoutLayer",
        "preferred_lanes": "stack.costmap.zone_layers:PreferredLanesLayer",
        "social": "stack.costmap.social_layer:SocialLayer",
    },
}
GROUPS = {
    "planner": "treepilot.planners",
    "controller": "treepilot.controllers",
    "costmap_layer": "treepilot.costmap_layers",
}


class CancelToken:
    """Cancels a search from any thread.

    Attributes:
        flag: (1,) uint8, 0 until cancellation is requested; compiled loops poll it.
    """

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.uint8)

    def request(self) -> None:
        """Request cancellation."""
        self.flag[0] = 1

    def check(self) -> None:
        """Raise NavigationError CANCELLED if cancellation was requested."""
        if self.flag[0]:
            raise NavigationError(FailureCode.CANCELLED, "the plan was cancelled")


@dataclass(frozen=True)
class PlanOptions:
    """Options of a plan request.

    Attributes:
        partial: accept a path to the nearest reachable pose, whatever the planner's parameters.
        direction: +1 or -1 if the robot drives forward or backward at the start of the plan, 0 if
            it stands. Planners with directions count a change of direction there as anywhere.
        cancel: when cancellation is requested, the planner may fail with CANCELLED.
    """

    partial: bool = False
    direction: int = 0
    cancel: CancelToken = field(default_factory=CancelToken)


DEFAULT_PLAN_OPTIONS = PlanOptions()
"""Default options; such a plan is never cancelled."""


class Component:
    """Base class of components.

    Attributes:
        Parameters: a frozen dataclass.
        parameters: current parameters.
    """

    Parameters: ClassVar[type]
    parameters: Any

    @staticmethod
    def check(parameters: Any, robot: RobotDescription) -> None:
        """Check the parameters against the robot, before anything moves.

        Raises:
            InputError: they do not fit the robot.
        """

    def configure(self, parameters: Any) -> None:
        """Apply new parameters; live tuning calls it between two steps."""
        self.parameters = parameters


class Planner(Component, ABC):
    """A global planner.

    Attributes:
        has_route_graph: whether `with_edge` opens and closes edges of a route graph.
    """

    has_route_graph: ClassVar[bool] = False

    def __init__(self, parameters: Any, robot: RobotDescription) -> None:
        self.parameters = parameters

    @abstractmethod
    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """Plan a smooth, collision-free path from start to goal, map frame.

        Headings are those of the robot: on backward segments they point against the motion. A
        planner may ignore the options. If it ignores `options.cancel`, an obsolete plan is computed
        to its end before the next one starts.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT at the limit of expansions, or CANCELLED.
        """

    def with_edge(self, edge: str, *, closed: bool) -> Planner:
        """Return a copy with an edge of the route graph closed or open.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """
        raise ParameterError(
            "edge", f"{edge!r}: the planner in use has no route graph",
            "use `planner: {use: route, graph: FILE}`",
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class ControlState:
    """Input of a controller in one step.

    Attributes:
        time: seconds on the robot's clock.
        pose: estimate, map frame.
        twist: measured velocity, base frame.
        costs: local costmap around the robot, map frame.
        tracks: moving objects extrapolated to `time`, map frame; only for controllers with
            `needs_tracks`.
        points: (m, 2) end points of the newest scan in the current base frame, metres; None
            without a scan.
    """

    time: float
    pose: Pose2D
    twist: Twist
    costs: CostGrid
    tracks: tuple[TrackedObject, ...] = ()
    points: FloatArray | None = None


class Controller(Component, ABC):
    """A path-following controller.

    Lifecycle: `start` at the beginning of a drive, `set_path` for each new path, `command` in each
    control step, `stop` at the end. `pause` and `resume` enclose a time in which the robot is held
    or drives elsewhere: it does not count for time limits.

    Attributes:
        needs_tracks: whether the controller uses tracks of moving objects.
    """

    needs_tracks: ClassVar[bool] = False

    def __init__(self, parameters: Any, robot: RobotDescription, period: float) -> None:
        self.parameters = parameters

    def start(self, now: float) -> None:
        """Begin a drive at a time in seconds."""

    @abstractmethod
    def set_path(self, path: Path) -> None:
        """Set the path to follow, map frame."""

    @abstractmethod
    def command(self, state: ControlState) -> Twist:
        """Compute the velocity command of this step, base frame.

        Raises:
            NavigationError: COLLISION_AHEAD if no command is safe.
        """

    def pause(self, now: float) -> None:
        """Hold the drive; no commands follow until `resume`."""

    def resume(self, now: float) -> None:
        """Continue the drive; the robot stands, perhaps at another place."""

    def stop(self, now: float) -> None:
        """End the drive."""

    @property
    def local_plan(self) -> Path | None:
        """The motion planned for the next seconds, map frame, for displays."""
        return None


BASES: dict[str, type[Component]] = {"planner": Planner, "controller": Controller}
"""The class that components of a kind inherit."""


@dataclass(frozen=True, slots=True)
class Choice:
    """A chosen component with its checked parameters.

    Attributes:
        kind: planner, controller, costmap_layer…
        name: of the component.
        component: its class.
        parameters: instance of `component.Parameters`.
        parts: sub-components: the layers of a costmap, the zones of the safety stage.
    """

    kind: str
    name: str
    component: type
    parameters: Any
    parts: tuple[Any, ...] = ()

    def create(self, *arguments: Any) -> Any:
        """Create the component: its class is called with the parameters and these arguments.

        Raises:
            InputError: the class does not accept them.
        """
        try:
            return self.component(self.parameters, *arguments)
        except TypeError as error:
            what = f"{self.kind.replace('_', ' ')} {self.name!r}"
            raise InputError(f"the {what} cannot be created: {error}") from error


def available(kind: str) -> dict[str, str]:
    """Available components of a kind: name -> `module:Class`, built-in ones first."""
    found = dict(BUILT_IN[kind])
    for entry in entry_points(group=GROUPS[kind]):
        found.setdefault(entry.name, entry.value)
    return found


def component(kind: str, name: str) -> type:
    """The class of a component, by the name of an installed one or by `module:Class`.

    Raises:
        InputError: there is no such component, or its module cannot be imported.
    """
    # Scanning the entry points of all installed packages is slow: skip it for built-in components.
    known = BUILT_IN[kind] if name in BUILT_IN[kind] else available(kind)
    if name not in known and ":" not in name:
        what = kind.replace("_", " ")
        raise InputError(f"there is no {what} {name!r}; {suggestion(name, known)}")
    where = known.get(name, name)
    module, _, attribute = where.partition(":")
    try:
        found: type = getattr(import_module(module), attribute)
    except Exception as error:  # a plugin's module may raise any exception
        raise InputError(f"the {kind} {name!r} in {where} cannot be used: {error}") from error
    reason = _unusable(kind, found)
    if reason:
        raise InputError(f"the {kind} {name!r} in {where} cannot be used: {reason}")
    return found


def _unusable(kind: str, found: type) -> str:
    """Reason why a class is no component of a kind; empty if it is one."""
    base = BASES.get(kind)
    if base is not None and not (isinstance(found, type) and issubclass(found, base)):
        return (
            f"it does not inherit stack.components.{base.__name__}; "
            f"write `class {getattr(found, '__name__', 'Name')}({base.__name__}):`"
        )
    missing = ", ".join(sorted(getattr(found, "__abstractmethods__", ())))
    if missing:
        return f"it does not implement {missing}"
    return "" if hasattr(found, "Parameters") else "it has no `Parameters`"


def choose(kind: str, name: str, values: dict[str, Any]) -> Choice:
    """Choose a component; its parameters are read and checked.

    Raises:
        InputError: there is no such component.
        ParameterError: a parameter is unknown or its value is wrong.
    """
    cls = component(kind, name)
    return Choice(kind, name, cls, build(cls.Parameters, values))  # type: ignore[attr-defined]


__all__ = [
    "CancelToken", "Choice", "Component", "ControlState", "Controller", "Footprint", "PlanOptions",
    "Planner", "available", "choose", "component",
]  # fmt: skip
