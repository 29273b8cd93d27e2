"""Components in the plugins of a mission."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from behaviours.catalogue import plugin_modules
from behaviours.kind import name_of
from stack.components import BASES, GROUPS, available, with_article
from stack.costmap.layer import Layer
from stack.errors import InputError


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
    found: dict[str, dict[str, str]] = {kind: {} for kind in GROUPS}
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
    known = {**available(kind), **found[kind]}
    if name in known:
        file = Path(inspect.getfile(cls)).name
        sentence = f"{name!r} is already {with_article(kind)}, in {known[name].partition(':')[0]}"
        raise InputError(f"{file}: {cls.__name__}: {sentence}; rename the class")
    found[kind][name] = f"{cls.__module__}:{cls.__qualname__}"


def _kind_of(cls: type) -> str | None:
    """Return the kind of a component; None of another class.

    A class that has all methods of a kind but not its base class is found too: choosing it is an
    error that names the class.
    """
    if issubclass(cls, Layer):
        return None if inspect.isabstract(cls) else "costmap_layer"
    for kind, base in BASES.items():
        if issubclass(cls, base):
            return kind
    if _is_like(cls, Layer):
        file = Path(inspect.getfile(cls)).name
        raise InputError(
            f"{file}: {cls.__name__} is not a costmap layer; inherit treepilot.CostmapLayer"
        )
    return next((kind for kind, base in BASES.items() if _is_like(cls, base)), None)


def _is_like(cls: type, base: Any) -> bool:
    return {"Parameters", *base.__abstractmethods__} <= set(dir(cls))
