"""One behaviour of the catalogue as a tree of its own, for an operator's detour."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from behaviours.catalogue import Catalogue, find_behaviours
from behaviours.kind import BehaviourKind, build
from missions.language.model import Mission
from missions.trees.context import Execution, Record
from missions.trees.leaves import LeafNode
from missions.trees.mission_tree import MissionTree
from stack.documents import Mark
from stack.documents.reader import value_of
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.needs import lacking, needs_text
from stack.errors import InputError, ParameterError
from stack.parameters import suggestion
from stack.robot import Robot
from stack.types import Assignments, Expression, Pose2D

Log = Callable[[str], None]
BY_THE_OPERATOR = Mark("operator")


def detour_maker(
    mission: Mission, described: RobotDescription, robot: Robot, log: Log
) -> Callable[[str, Mapping[str, Any]], MissionTree]:
    """Return a function that makes a tree of one behaviour, ready to tick.

    Its arguments are a name of the catalogue, plugins of the mission included, and the ports as a
    mission file writes them; a pose can be the name of a place. It raises InputError or
    ParameterError for an unknown name, port or place, a value that is wrong, and a behaviour
    that needs an expression or what the robot lacks.
    """

    @cache
    def catalogue() -> Catalogue:
        return find_behaviours(mission.plugins, mission.source.parent)

    def make(name: str, ports: Mapping[str, Any]) -> MissionTree:
        kind = catalogue().get(name)
        if kind is None:
            raise InputError(catalogue().why_not(name))
        needs = list(lacking(kind.needs, described))
        if needs:
            raise InputError(f"{name} {needs_text(needs)}; {described.name} has none")
        tree = _tree(kind, _values(kind, ports, mission.places), mission.places)
        tree.setup(robot, None, log)
        return tree

    return make


def _values(
    kind: BehaviourKind, ports: Mapping[str, Any], places: Mapping[str, Pose2D]
) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for port, text in ports.items():
        declared = kind.ports.get(port)
        value = value_of(text)
        if declared is not None and declared.type in (Expression, Assignments):
            raise InputError(f"{kind.name}: {port} is an expression; only a mission can compute it")
        if declared is not None and declared.type is Pose2D and isinstance(value, str):
            if value not in places:
                raise ParameterError(port, f"no place {value!r}", suggestion(value, places))
            pose = places[value]
            value = [pose.x, pose.y, pose.heading]
        values[port] = value
    return values


def _tree(
    kind: BehaviourKind, values: Mapping[str, Any], places: Mapping[str, Pose2D]
) -> MissionTree:
    execution = Execution()
    execution.place_names = {pose: name for name, pose in places.items()}
    leaf = build(kind, kind.name, values)
    node = LeafNode(leaf, execution)
    detail = ", ".join(f"{name} {value}" for name, value in values.items())
    execution.records[id(node)] = Record(node, kind.name, kind.name, detail, BY_THE_OPERATOR)
    return MissionTree(kind.name, node, execution, {})
