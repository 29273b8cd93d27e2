"""The model of a checked mission, between the reader and the compiler."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from missions.language.case_model import Case
from missions.language.expressions.scope import Symbol
from missions.language.step import Event, Step, Tree
from stack.documents import Finding, Findings, Mark, Node
from stack.sim.faults.planned import PlannedFault
from stack.types import Pose2D


def _accept(*_: Any) -> None:
    """Accept anything: the default of optional checks."""


@dataclass(frozen=True, slots=True)
class Resources:
    """Access to everything outside the mission file.

    Each callable raises InputError or ParameterError.

    Attributes:
        world_places: (world as written, mission's folder) -> the world's named poses.
        check_robot: (robot as written, mission's folder).
        check_map: (map as written, mission's folder); not called for `from_world` and `none`.
        check_markers: (map of markers as written, mission's folder); likewise.
        check_component: (kind, name or None for the default, raw parameters, whether there is a
            map).
        plugged_components: (plugins as written, mission's folder) -> the components in them: kind
            -> name -> location, which the other callables accept in place of a name.
        nav2_components: (Nav2 parameter file as written, namespace of the robot in it or None,
            mission's folder) -> its components by kind, and warnings.
        accepted_parameters: (kind, name, raw parameters) -> those that the component has too.
        navigation_kinds: the keys under `navigation`.
        faults: (entries of `faults`, findings, places) -> the faults.
    """

    world_places: Callable[[str, Path], Mapping[str, Pose2D]] = lambda name, folder: {}
    check_robot: Callable[[str, Path], None] = _accept
    check_map: Callable[[str, Path], None] = _accept
    check_markers: Callable[[str, Path], None] = _accept
    check_component: Callable[[str, str | None, Mapping[str, Any], bool], None] = _accept
    plugged_components: Callable[[Sequence[str], Path], Mapping[str, Mapping[str, str]]] = (
        lambda plugins, folder: {}
    )
    nav2_components: Callable[
        [str, str | None, Path], tuple[Mapping[str, Component], Sequence[Finding]]
    ] = lambda file, namespace, folder: ({}, ())
    accepted_parameters: Callable[[str, str, Mapping[str, Any]], Mapping[str, Any]] = (
        lambda kind, name, values: values
    )
    navigation_kinds: Sequence[str] = ()
    faults: Callable[[Sequence[Node], Findings, Mapping[str, Pose2D]], tuple[PlannedFault, ...]] = (
        lambda nodes, findings, places: ()
    )


@dataclass(frozen=True, slots=True)
class Component:
    """A component of navigation or localisation, unchecked: `{use: astar, allow_unknown: true}`.

    Attributes:
        use: name of the component; None for that of the robot or the default.
        values: parameters as written.
        marks: position of each parameter.
    """

    kind: str
    use: str | None
    mark: Mark
    values: Mapping[str, Any] = field(default_factory=dict)
    marks: Mapping[str, Mark] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Replay:
    """A log that is played instead of driving.

    Attributes:
        log: absolute, or relative to the current folder.
        mark: position of its name.
        lidars: topics of a ROS bag; empty: all.
        odometry: topic; empty: the first.
        imu: topic; empty: the first.
        after: seconds that the robot stands after the end of the log.
    """

    log: Path
    mark: Mark
    lidars: tuple[str, ...] = ()
    odometry: str = ""
    imu: str = ""
    after: float = 0.0


@dataclass(frozen=True, slots=True)
class Mission:
    """A mission that has been read and checked.

    Attributes:
        robot, world, map: as written; paths are relative to the folder of `source`.
            With a log, `robot` describes the drive; then `world` may be empty.
        replay: the log that is played; None for a robot that drives.
        markers: `from_world`, `none`, or a file as written; empty if the mission does not say.
        start: true start pose in the simulation, map frame; None for the world's own.
        initial_pose: initial pose estimate: `start`, `unknown` or a pose.
        components: by kind: those under `navigation`, and `localisation`.
        places: places of the world and of the mission, map frame.
        arguments: name -> value.
        blackboard: declared keys with type and initial value.
        cases: test cases for `treepilot test`.
        events: events, the most important one first.
        trees: by name, included ones too.
        includes: included files, directly or indirectly.
        parameter_files: as written, already merged into `components`.
        warnings: warnings of the checks.
        faults: of its robot, when it is simulated.
    """

    name: str
    source: Path
    root: Step
    robot: str
    world: str
    doc: str = ""
    start: Pose2D | None = None
    map: str = "from_world"
    initial_pose: Pose2D | str = "start"
    components: Mapping[str, Component] = field(default_factory=dict)
    parameter_files: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()
    places: Mapping[str, Pose2D] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    blackboard: Mapping[str, Symbol] = field(default_factory=dict)
    trees: Mapping[str, Tree] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    cases: tuple[Case, ...] = ()
    includes: tuple[Path, ...] = ()
    warnings: tuple[Finding, ...] = ()
    replay: Replay | None = None
    markers: str = ""
    faults: tuple[PlannedFault, ...] = ()
