"""What missions know of a behaviour class, and nodes built from it.

The class NavigateToPose is navigate_to_pose in a mission.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from py_trees import behaviours
from py_trees.behaviour import Behaviour
from py_trees.composites import Composite
from py_trees.decorators import Decorator

from behaviours._plugins import plain_leaf
from behaviours._plugins.port_types import check_ports
from behaviours.base import RobotBehaviour
from stack.drivetrain.needs import claims_problem, needs_problem
from stack.errors import ParameterError
from stack.parameters import Declaration, suggestion
from stack.types import Assignments, Expression

_PLAIN: dict[type, dict[str, bool]] = {
    behaviours.Success: {"can_fail": False}, behaviours.Failure: {"can_succeed": False},
    behaviours.Running: {"can_succeed": False, "can_fail": False},
}  # fmt: skip
"""Leaves of py_trees that cannot succeed or fail; any other one can."""


@dataclass(frozen=True, kw_only=True)
class BehaviourTraits:
    """What a behaviour class declares of itself; RobotBehaviour says what each of them means."""

    claims: tuple[str, ...]
    takes_time: bool
    is_instant: bool
    duration_port: str
    is_condition: bool
    can_succeed: bool
    can_fail: bool
    fails_with: tuple[str, ...] | None
    ends_by: tuple[str, ...]
    failure_ports: tuple[str, ...]
    goal_ports: tuple[str, ...]
    area_ports: tuple[str, ...]
    arrival_port: str
    runs_in_tests: bool
    also_known_as: tuple[str, ...]
    needs: tuple[str, ...]
    edge_port: str
    label_port: str
    one_port_of: tuple[str, ...]
    joints_port: str
    posture_port: str
    box_ports: tuple[str, ...]
    finds_blocks: bool
    block_port: str
    drives_backward: bool


@dataclass(frozen=True, kw_only=True)
class BehaviourKind(BehaviourTraits):
    """A behaviour that missions can use.

    Attributes:
        name: as written in missions.
        ports: inputs by name.
        outputs: outputs by name; empty for a plain py_trees leaf.
        doc: docstring, unindented.
        source: file that defines it.
    """

    name: str
    cls: type[Behaviour]
    ports: Mapping[str, Declaration]
    outputs: Mapping[str, Declaration]
    doc: str
    source: str

    @property
    def summary(self) -> str:
        """First line of the docstring."""
        return self.doc.partition("\n")[0]

    @property
    def is_built_in(self) -> bool:
        """Whether its class is part of treepilot."""
        return self.cls.__module__.partition(".")[0] == __name__.partition(".")[0]

    @property
    def bindable(self) -> bool:
        """Whether ports can be bound to a `$key`; those of a plain py_trees leaf are constants."""
        return issubclass(self.cls, RobotBehaviour)


class UnusableClass(Exception):
    """A class or module that missions cannot use; the message says why."""


def build(kind: BehaviourKind, name: str, ports: Mapping[str, Any]) -> Behaviour:
    """Build one node.

    Args:
        kind: from the catalogue.
        name: label of the node.
        ports: raw or checked values; None for a port that is bound later.

    Raises:
        ParameterError: a port does not exist, is missing, or has an invalid value.
    """
    for port in ports:
        if port not in kind.ports:
            sentence = f"{kind.name} has no port {port!r}"
            raise ParameterError(port, sentence, suggestion(port, kind.ports))
    for port, declared in kind.ports.items():
        if declared.required and port not in ports:
            raise ParameterError(port, f"{kind.name} needs this port: {declared.help}".rstrip(": "))
    values = {port: _value(kind.ports[port], raw) for port, raw in ports.items()}
    if issubclass(kind.cls, RobotBehaviour):
        return kind.cls(name=name, **values)
    return plain_leaf.build(kind.cls, name, values)


def _value(declared: Declaration, raw: Any) -> Any:
    """Convert a raw value; expressions are already compiled."""
    if raw is None or declared.type in (Expression, Assignments):
        return raw
    return declared.read(raw)


def name_of(cls: type) -> str:
    """Return the name in missions: NavigateToPose -> navigate_to_pose, HTTPGet -> http_get."""
    pattern = r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])"
    return re.sub(pattern, "_", cls.__name__).lower()


def is_leaf(cls: type) -> bool:
    """Whether missions can use a class: a public leaf, not a composite or decorator."""
    return (
        issubclass(cls, Behaviour)
        and not issubclass(cls, Composite | Decorator)
        and cls is not RobotBehaviour
        and not cls.__name__.startswith("_")
    )


def kind_of(name: str, cls: type) -> BehaviourKind:
    """Return what a class declares of itself.

    Raises:
        UnusableClass: missions cannot use the class.
    """
    if not (inspect.isclass(cls) and issubclass(cls, Behaviour)):
        raise UnusableClass("it is not a py_trees Behaviour class")
    if not is_leaf(cls):
        raise UnusableClass("only leaves can be used this way, not composites and decorators")
    if inspect.isabstract(cls):
        raise UnusableClass("it is abstract")
    if cls.__module__.split(".")[:2] == ["py_trees", "timers"]:
        raise UnusableClass("py_trees' timers read wall time; use `wait`")
    try:
        if issubclass(cls, RobotBehaviour):
            ports, outputs = cls.ports(), cls.outputs()
            check_ports(ports)
        else:
            ports, outputs = plain_leaf.ports(cls), {}
    except (ParameterError, TypeError, NameError) as error:
        raise UnusableClass(str(error)) from error
    declared = cls if issubclass(cls, RobotBehaviour) else RobotBehaviour
    problem = needs_problem(declared.needs) or claims_problem(declared.claims)
    if problem:
        raise UnusableClass(problem)
    traits = {trait.name: getattr(declared, trait.name) for trait in fields(BehaviourTraits)}
    traits["takes_time"] = bool(declared.claims) or declared.takes_time
    traits["needs"] = tuple(dict.fromkeys((*declared.claims, *declared.needs)))
    traits.update(_PLAIN.get(cls, {}))
    return BehaviourKind(
        name=name, cls=cls, ports=ports, outputs=outputs, doc=inspect.cleandoc(cls.__doc__ or ""),
        source=inspect.getfile(cls), **traits,
    )  # fmt: skip
