"""Planners, controllers and costmap layers in a mission's plugins."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from pathlib import Path

from behaviours.catalogue import name_of, plugin_modules
from stack.components import GROUPS, available
from stack.errors import InputError

METHODS = {
    "planner": ("plan",),
    "controller": ("set_path", "command"),
    "costmap_layer": ("lay_out", "paint"),
}
"""What a class with `Parameters` must have to be a component of a kind."""


def plugged_components(
    plugins: Sequence[str], beside: Path | None = None
) -> dict[str, dict[str, str]]:
    """The components in plugins: kind -> name in missions -> `module:Class`.

    A class StraightLine is written straight_line. Modules that cannot be imported are left out:
    finding the behaviours in them says why.

    Args:
        plugins: folders or files (with a slash, or ending in .py), or dotted modules.
        beside: the folder that relative paths start from; the current one when None.

    Raises:
        InputError: a name that is taken.
    """
    found: dict[str, dict[str, str]] = {kind: {} for kind in METHODS}
    for module in plugin_modules(plugins, beside):
        for cls in vars(module).copy().values():
            if inspect.isclass(cls) and cls.__module__ == module.__name__:
                _add(found, cls)
    return found


def _add(found: dict[str, dict[str, str]], cls: type) -> None:
    kind = _kind_of(cls)
    if kind is None or cls.__name__.startswith("_"):
        return
    name = name_of(cls)
    taken = {**(available(kind) if kind in GROUPS else {}), **found[kind]}
    if name in taken:
        file = Path(inspect.getfile(cls)).name
        sentence = f"{name!r} is already a {kind}, in {taken[name].partition(':')[0]}"
        raise InputError(f"{file}: {cls.__name__}: {sentence}; rename the class")
    found[kind][name] = f"{cls.__module__}:{cls.__qualname__}"


def _kind_of(cls: type) -> str | None:
    if not hasattr(cls, "Parameters"):
        return None
    fitting = (
        kind for kind, methods in METHODS.items() if all(hasattr(cls, name) for name in methods)
    )
    return next(fitting, None)
