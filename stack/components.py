"""Components of navigation and localisation, chosen by name and extensible by plugins.

A component class inherits the base class of its kind, which gives defaults for what is optional. It
has a class attribute `Parameters` (a frozen dataclass of `parameter(...)` fields) and a docstring
whose first line describes it. Its module must not import numba, cv2 or its kernels at module level
but in `__init__`, so that checking a mission imports none of them. Plugins register classes in the
entry-point groups of `GROUPS`. Layers inherit `Layer` of
stack/costmap/layer.py.
"""

from __future__ import annotations

import sys
from abc import ABCMeta
from collections.abc import Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from stack.compilation import KernelTypes
from stack.component_bases.component import Component
from stack.component_bases.driving import (
    Controller,
    ControlState,
    DriveState,
    GoalChecker,
    GoalTolerance,
    ProgressChecker,
    StopCriterion,
)
from stack.component_bases.localisation import Estimator, Match, OdometryFusion
from stack.component_bases.planning import (
    DEFAULT_PLAN_OPTIONS,
    CancelToken,
    Planner,
    PlanOptions,
)
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.needs import needs_problem
from stack.errors import InputError, ParameterError
from stack.frames.buffer import TransformBuffer
from stack.geometry.path_segment import PathSegment
from stack.parameters import build, declarations, suggestion
from stack.plugins import class_places

BUILT_IN: dict[str, dict[str, str]] = {
    "planner": {
        "astar": "stack.planning.astar:Astar",
        "theta_star": "stack.planning.theta_star.planner:ThetaStar",
        "hybrid_astar": "stack.planning.kinematic.hybrid_astar:HybridAstar",
        "lattice": "stack.planning.kinematic.lattice:Lattice",
        "route": "stack.planning.routes.planner:Route",
    },
    "controller": {
        "pure_pursuit": "stack.control.pure_pursuit.controller:PurePursuit",
        "mppi": "stack.control.mppi.controller:Mppi",
        "dwb": "stack.control.dwb.controller:Dwb",
        "graceful": "stack.control.graceful:Graceful",
        "onnx_policy": "stack.control.policy.controller:OnnxPolicy",
    },
    "goal_checker": {
        "stopped_goal": "stack.control.checkers:StoppedGoalChecker",
        "simple_goal": "stack.control.checkers:SimpleGoalChecker",
    },
    "progress_checker": {
        "pose_progress": "stack.control.checkers:PoseProgressChecker",
        "simple_progress": "stack.control.checkers:SimpleProgressChecker",
    },
    "localisation": {
        "mcl": "stack.localisation.mcl.localiser:Localiser",
        "dead_reckoning": "stack.localisation.dead_reckoning:DeadReckoning",
        "slam": "stack.mapping.slam.estimator:SlamEstimator",
        "pose_graph": "stack.mapping.slam.pose_graph_localiser:PoseGraphLocaliser",
    },
    "odometry": {
        "ekf": "stack.localisation.fusion.ekf:EkfOdometry",
        "wheels_gyro": "stack.localisation.fusion.wheels_gyro:WheelGyroOdometry",
    },
    "costmap_layer": {
        "static": "stack.costmap.layers.static_layer:StaticLayer",
        "obstacle": "stack.costmap.layers.obstacle_layer:ObstacleLayer",
        "range": "stack.costmap.layers.range_layer:RangeLayer",
        "depth": "stack.costmap.layers.depth_layer:DepthLayer",
        "denoise": "stack.costmap.layers.denoise_layer:DenoiseLayer",
        "keepout": "stack.costmap.layers.zone_layers:KeepoutLayer",
        "preferred_lanes": "stack.costmap.layers.zone_layers:PreferredLanesLayer",
        "social": "stack.costmap.layers.social_layer:SocialLayer",
        "semantic": "stack.costmap.layers.semantic_layer:SemanticLayer",
    },
}
DEFAULTS = {
    "planner": "astar",
    "controller": "pure_pursuit",
    "goal_checker": "stopped_goal",
    "progress_checker": "pose_progress",
    "localisation": "mcl",
    "odometry": "wheels_gyro",
}
"""The component of a kind that is used unless a mission or a robot names one."""

GROUPS = {
    "planner": "treepilot.planners",
    "controller": "treepilot.controllers",
    "goal_checker": "treepilot.goal_checkers",
    "progress_checker": "treepilot.progress_checkers",
    "localisation": "treepilot.estimators",
    "odometry": "treepilot.odometry",
    "costmap_layer": "treepilot.costmap_layers",
}

BASES: dict[str, type[Component]] = {
    "planner": Planner,
    "controller": Controller,
    "goal_checker": GoalChecker,
    "progress_checker": ProgressChecker,
    "localisation": Estimator,
    "odometry": OdometryFusion,
}
"""The class that components of a kind inherit."""

_OWN_MODULES = {
    where.partition(":")[0] for classes in BUILT_IN.values() for where in classes.values()
}
"""Imported for `module:Class`; other modules must be installed plugins or already imported."""

_NOUNS = {"localisation": "estimator", "odometry": "odometry fusion"}
"""What a component is called if not as its key in missions."""


def noun(kind: str) -> str:
    """What a component of a kind is called in messages: `goal checker`, `estimator`."""
    return _NOUNS.get(kind, kind.replace("_", " "))


def with_article(kind: str) -> str:
    """`noun` with its article: `a goal checker`, `an estimator`."""
    return f"{'an' if noun(kind)[0] in 'aeiou' else 'a'} {noun(kind)}"


@dataclass(frozen=True, slots=True)
class Choice:
    """A chosen component with its checked parameters.

    Attributes:
        kind: planner, controller, localisation, costmap_layer…
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

    def kernels(self, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of the component; settings of a fixed part have none here."""
        if not issubclass(self.component, Component):
            return ()
        return self.component.kernels(self.parameters, robot)

    def create(self, *arguments: Any) -> Any:
        """Create the component: its class is called with the parameters and these arguments.

        Raises:
            InputError: the class does not accept them.
        """
        return self.created_with(self.parameters, *arguments)

    def created_with(self, parameters: Any, *arguments: Any) -> Any:
        """Create the component with other parameters; else as `create`."""
        try:
            return self.component(parameters, *arguments)
        except TypeError as error:
            what = f"{noun(self.kind)} {self.name!r}"
            raise InputError(f"the {what} cannot be created: {error}") from error


def available(kind: str) -> dict[str, str]:
    """Available components of a kind: name -> `module:Class`, built-in ones first."""
    return class_places(GROUPS[kind], BUILT_IN[kind])


def component(kind: str, name: str) -> type:
    """The class of a component, by the name of an installed one or by `module:Class`.

    Raises:
        InputError: there is no such component, or its module cannot be imported.
    """
    # Scanning the entry points of all installed packages is slow: skip it for built-in components.
    known = BUILT_IN[kind] if name in BUILT_IN[kind] else available(kind)
    if name not in known and ":" not in name:
        raise InputError(f"there is no {noun(kind)} {name!r}", suggestion(name, known))
    where = known.get(name, name)
    module, _, attribute = where.partition(":")
    if name not in known and module not in sys.modules and module not in _OWN_MODULES:
        hint = f"add its module to the mission: `plugins: [{module}]`"
        raise InputError(f"the {noun(kind)} {name!r} cannot be used: {hint}")
    try:
        with redirect_stdout(sys.stderr):
            found: type = getattr(import_module(module), attribute)
    except (Exception, SystemExit) as error:  # a plugin's module may raise any exception
        raise InputError(f"the {noun(kind)} {name!r} in {where} cannot be used: {error}") from error
    reason = _unusable(kind, attribute, found)
    if reason:
        raise InputError(f"the {noun(kind)} {name!r} in {where} cannot be used: {reason}")
    return found


def _unusable(kind: str, name: str, found: type) -> str:
    """Reason why a class is no component of a kind; empty if it is one."""
    base = BASES.get(kind)
    if base is not None and not (isinstance(found, type) and issubclass(found, base)):
        return (
            f"it does not inherit treepilot.{base.__name__}; write `class {name}({base.__name__}):`"
        )
    if isinstance(found, ABCMeta) and found.__abstractmethods__:
        return f"it does not implement {', '.join(sorted(found.__abstractmethods__))}"
    if not hasattr(found, "Parameters"):
        return "it has no `Parameters`"
    return "" if base is None else needs_problem(found.needs)  # type: ignore[attr-defined]


def choose(kind: str, name: str, values: dict[str, Any]) -> Choice:
    """Choose a component; its parameters are read and checked.

    Raises:
        InputError: there is no such component.
        ParameterError: a parameter is unknown or its value is wrong.
    """
    cls = component(kind, name)
    return Choice(kind, name, cls, build(cls.Parameters, values))  # type: ignore[attr-defined]


def accepted(kind: str, name: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters, set for another component, that this one has and accepts too.

    Raises:
        InputError: there is no such component.
    """
    parameters: Any = component(kind, name).Parameters  # type: ignore[attr-defined]
    known = declarations(parameters)
    kept = {key: value for key, value in values.items() if key in known}
    while kept:
        try:
            build(parameters, kept)
        except ParameterError as error:
            if error.name not in kept:
                return {}
            del kept[error.name]
        else:
            break
    return kept


__all__ = [
    "DEFAULTS", "DEFAULT_PLAN_OPTIONS", "CancelToken", "Choice", "Component", "ControlState",
    "Controller", "DriveState", "Estimator", "GoalChecker", "GoalTolerance", "Match",
    "OdometryFusion", "PathSegment", "PlanOptions", "Planner", "ProgressChecker", "StopCriterion",
    "TransformBuffer", "accepted", "available", "choose", "component", "noun", "with_article",
]  # fmt: skip
