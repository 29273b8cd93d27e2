"""Planners, controllers and costmap layers: chosen by name, replaceable by plugin.

A component class has a class attribute `Parameters` (a frozen dataclass of `parameter(...)` fields)
and a docstring whose first line says what it is. Its module must not import numba, cv2 or its
kernels at module level but in `__init__`, so that checking a mission imports none of them.
What its parameters ask of the robot may be checked in a static method `check(parameters, robot)`,
which raises InputError. Plugins name such a class under the entry-point groups
`treepilot.planners`, `treepilot.controllers` and `treepilot.costmap_layers`. What a layer has to do
is said in stack/costmap/layer.py.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from inspect import signature
from typing import Any, ClassVar, Protocol

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, NavigationError
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
        "inflation": "stack.costmap.inflation_layer:InflationLayer",
        "preferred_lanes": "stack.costmap.zone_layers:PreferredLanesLayer",
        "speed_zones": "stack.costmap.zone_layers:SpeedZonesLayer",
        "social": "stack.costmap.social_layer:SocialLayer",
    },
}
GROUPS = {
    "planner": "treepilot.planners",
    "controller": "treepilot.controllers",
    "costmap_layer": "treepilot.costmap_layers",
}


class CancelToken:
    """A wish, from any thread, that a search be given up.

    Attributes:
        flag: (1,) uint8, 0 until it is wished for; compiled loops look at it now and then.
    """

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.uint8)

    def request(self) -> None:
        """Wish for it."""
        self.flag[0] = 1

    def check(self) -> None:
        """Raise NavigationError CANCELLED once it is wished for."""
        if self.flag[0]:
            raise NavigationError(FailureCode.CANCELLED, "nobody wants the plan any more")


@dataclass(frozen=True)
class PlanOptions:
    """On what terms a plan is asked for.

    Attributes:
        partial: as near to the goal as can be will do, whatever the planner's parameters say.
        direction: +1 or -1 when the robot drives forward or backward as the plan begins, 0 when it
            stands: planners that know of directions count a change of it there as anywhere.
        cancel: when this is wished for, the plan may be given up with CANCELLED.
    """

    partial: bool = False
    direction: int = 0
    cancel: CancelToken = field(default_factory=CancelToken)


DEFAULT_PLAN_OPTIONS = PlanOptions()
"""The parameters' own, and nobody has the stop in hand."""


class Planner(Protocol):
    """A global planner.

    Its `plan` may have a fourth parameter, `options: PlanOptions`. A planner without it cannot be
    cancelled: a plan that is no longer wanted is computed to its end before the next one starts.
    """

    Parameters: ClassVar[type]

    def __init__(self, parameters: Any, robot: RobotDescription) -> None: ...

    def plan(self, costs: CostGrid, start: Pose2D, goal: Pose2D) -> Path:
        """A path of poses in the map frame from start to goal, smoothed, free of collisions.

        Headings are the robot's: where it drives backward they point against the motion.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT at a limit of expansions, or CANCELLED.
        """
        ...


def plan_with_options(
    planner: Any, costs: CostGrid, ends: tuple[Pose2D, Pose2D], options: PlanOptions
) -> Path:
    """A plan from a pose to another, on terms where the planner knows of such."""
    if "options" in signature(planner.plan).parameters:
        path: Path = planner.plan(costs, *ends, options)
    else:
        path = planner.plan(costs, *ends)
    return path


@dataclass(frozen=True, slots=True)
class ControlState:
    """What a controller may look at in one step.

    Attributes:
        time: seconds on the robot's clock.
        pose: map frame.
        twist: measured velocity.
        costs: the local costmap, map frame, around the robot.
        tracks: what moves around it, map frame, as of now; only for controllers that ask for it.
        points: (m, 2) what the newest scan met, base frame of now, metres; None without a scan.
    """

    time: float
    pose: Pose2D
    twist: Twist
    costs: CostGrid
    tracks: tuple[TrackedObject, ...] = ()
    points: FloatArray | None = None


class Controller(Protocol):
    """Follows a path. A class attribute `needs_tracks = True` asks for tracks of moving things.

    Attributes:
        parameters: those in force; live tuning puts others there between two steps, or calls
            `configure(parameters)` where there is such a method.
    """

    Parameters: ClassVar[type]
    parameters: Any

    def __init__(self, parameters: Any, robot: RobotDescription, period: float) -> None: ...

    def set_path(self, path: Path) -> None:
        """A new path to follow, map frame."""
        ...

    def command(self, state: ControlState) -> Twist:
        """The velocity to drive now.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing safe can be commanded.
        """
        ...

    @property
    def local_plan(self) -> Path | None:
        """What it means to drive next, map frame, for the screen."""
        ...


@dataclass(frozen=True, slots=True)
class Choice:
    """A component by name with its checked parameters.

    Attributes:
        parts: what it is made of besides: the layers of a costmap, the zones of the safety stage.
    """

    kind: str
    name: str
    component: type
    parameters: Any
    parts: tuple[Any, ...] = ()


def available(kind: str) -> dict[str, str]:
    """Names of a kind's components and where they are defined, built-ins first."""
    found = dict(BUILT_IN[kind])
    for entry in entry_points(group=GROUPS[kind]):
        found.setdefault(entry.name, entry.value)
    return found


def component(kind: str, name: str) -> type:
    """The class of a component: by the name of an installed one, or as `module:Class`.

    Raises:
        InputError: there is no such component, or its module cannot be imported.
    """
    # Looking through everything that is installed takes its time: only for what is not built in.
    known = BUILT_IN[kind] if name in BUILT_IN[kind] else available(kind)
    if name not in known and ":" not in name:
        what = kind.replace("_", " ")
        raise InputError(f"there is no {what} {name!r}; {suggestion(name, known)}")
    where = known.get(name, name)
    module, _, attribute = where.partition(":")
    try:
        found: type = getattr(import_module(module), attribute)
    except Exception as error:  # a plugin's module may raise anything
        raise InputError(f"the {kind} {name!r} in {where} cannot be used: {error}") from error
    if not hasattr(found, "Parameters"):
        raise InputError(f"the {kind} {name!r} in {where} cannot be used: it has no `Parameters`")
    return found


def choose(kind: str, name: str, values: dict[str, Any]) -> Choice:
    """A component with its parameters read and checked.

    Raises:
        InputError: no such component.
        ParameterError: an unknown parameter or a value that will not do.
    """
    cls = component(kind, name)
    return Choice(kind, name, cls, build(cls.Parameters, values))  # type: ignore[attr-defined]


__all__ = [
    "CancelToken", "Choice", "ControlState", "Controller", "Footprint", "PlanOptions", "Planner",
    "available", "choose", "component",
]  # fmt: skip
