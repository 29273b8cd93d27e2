"""Components in the plugins of a mission."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from pathlib import Path

from behaviours.catalogue import name_of, plugin_modules
from stack.components import BASES, GROUPS, available, with_article
from stack.costmap.layer import Layer
from stack.errors import InputError

METHODS = {
    "planner": {"Parameters", "plan"},
    "controller": {"Parameters", "set_path", "command"},
    "goal_checker": {"Parameters", "set_goal", "reached"},
    "progress_checker": {"Parameters", "stuck"},
    "localisation": {"Parameters", "update", "set_pose"},
    "odometry": {"Parameters", "update"},
}
"""Attributes that make a class without the base class a component, by kind.

A planner or controller that does not inherit the base class is found too: choosing it is an error
that names the class.
"""

LAYER_METHODS = {"Parameters", "lay_out", "paint"}
"""Attributes of layers of earlier versions, which had no base class."""


def plugged_components(
    plugins: Sequence[str], folder: Path | None = None
) -> dict[str, dict[str, str]]:
    """Return the components in plugins: kind -> name in missions -> `module:Class`.

    A class `StraightLine` is called `straight_line` in missions. Modules that cannot be imported
    are skipped; the search for behaviours reports them.

    Args:
        plugins: folders or files (with a slash, or ending in .py), or dotted modules.
        folder: base of relative paths; None is the current folder.

    Raises:
        InputError: the name of a component is already in use, or a layer does not inherit `Layer`.
    """
    found: dict[str, dict[str, str]] = {kind: {} for kind in (*METHODS, "costmap_layer")}
    for module in plugin_modules(plugins, folder):
        for cls in vars(module).copy().values():
            if inspect.isclass(cls) and cls.__module__ == module.__name__:
                _add(found, cls)
    return found


def _add(found: dict[str, dict[str, str]], cls: type) -> None:
    kind = _kind_of(cls)
    if kind is None or cls.__name__.startswith("_"):
        return
    name = name_of(cls)
    known = {**(available(kind) if kind in GROUPS else {}), **found[kind]}
    if name in known:
        file = Path(inspect.getfile(cls)).name
        sentence = f"{name!r} is already {with_article(kind)}, in {known[name].partition(':')[0]}"
        raise InputError(f"{file}: {cls.__name__}: {sentence}; rename the class")
    found[kind][name] = f"{cls.__module__}:{cls.__qualname__}"


def _kind_of(cls: type) -> str | None:
    if issubclass(cls, Layer):
        return None if inspect.isabstract(cls) else "costmap_layer"
    there = set(dir(cls))
    if there >= LAYER_METHODS:
        file = Path(inspect.getfile(cls)).name
        raise InputError(
            f"{file}: {cls.__name__} is not a costmap layer; inherit treepilot.CostmapLayer"
        )
    for kind, base in BASES.items():
        if issubclass(cls, base):
            return kind
    return next((kind for kind, methods in METHODS.items() if there >= methods), None)
