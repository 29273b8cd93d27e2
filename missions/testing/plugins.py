"""For tests of plugins: creates what a file defines, by the names and values of missions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from behaviours.catalogue import Catalogue, find_behaviours
from behaviours.kind import build
from missions.execution.plugin_components import plugged_components
from missions.language.sections import mission_words
from robots.load import find_robot, read_robot
from stack.components import GROUPS, Choice, available, choose, noun
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import suggestion


def make_behaviour(
    name: str, ports: Mapping[str, Any] | None = None, *, plugin: str | Path | None = None
) -> Any:
    """Create a behaviour.

    Args:
        name: in missions, for example look_around.
        ports: values as in missions, for example {"time": "2 s"}.
        plugin: file or folder that defines it; None for a shipped or installed one.

    Raises:
        InputError: there is no such behaviour, or the plugin has an error.
        ParameterError: a port does not exist, is missing, or has an invalid value.
    """
    catalogue = _catalogue(plugin)
    kind = catalogue.get(name)
    if kind is None:
        raise InputError(catalogue.why_not(name))
    return build(kind, name, ports or {})


def choose_component(
    kind: str,
    name: str,
    parameters: Mapping[str, Any] | None = None,
    *,
    plugin: str | Path | None = None,
) -> Choice:
    """Choose a component; `create` of the result creates it.

    Args:
        kind: planner, controller, localisation, costmap_layer and so on.
        name: in missions, for example beeline.
        parameters: values as in missions, for example {"spacing": "10 cm"}.
        plugin: file or folder that defines it; None for a shipped or installed one.

    Raises:
        InputError: there is no such component, or the plugin cannot be used.
        ParameterError: a parameter is unknown or its value is wrong.
    """
    if kind not in GROUPS:
        raise InputError(f"there is no kind of component {kind!r}; {suggestion(kind, GROUPS)}")
    _catalogue(plugin)  # reports a file that cannot be imported
    plugged = plugged_components(_plugins(plugin))[kind]
    known = {**available(kind), **plugged}
    if name not in known:
        raise InputError(f"there is no {noun(kind)} {name!r}; {suggestion(name, known)}")
    return choose(kind, plugged.get(name, name), dict(parameters or {}))


def describe_robot(name: str) -> RobotDescription:
    """Return the description of a robot: a shipped one, or the path of a robot.yaml.

    Raises:
        InputError: there is no such robot, or its file has an error.
    """
    return read_robot(find_robot(name, Path()))


def _catalogue(plugin: str | Path | None) -> Catalogue:
    """Find the behaviours.

    Raises:
        InputError: the plugin has an error.
    """
    catalogue = find_behaviours(_plugins(plugin), reserved=mission_words())
    asked_for = [problem for problem in catalogue.problems if problem.plugin >= 0]
    if asked_for:
        raise InputError("\n".join(f"{it.file}: {it.sentence}" for it in asked_for))
    return catalogue


def _plugins(plugin: str | Path | None) -> list[str]:
    return [] if plugin is None else [str(Path(plugin).absolute())]
