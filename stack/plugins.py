"""Classes of plugins, which installed packages register as entry points, and our own beside them.

Both are named by `module:Class`, and imported when they are used.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points
from typing import TypeVar

from stack.errors import InputError
from stack.parameters import suggestion

T = TypeVar("T")


def class_places(group: str, built_in: Mapping[str, str]) -> dict[str, str]:
    """Return the classes of a group: name -> `module:Class`, built-in ones first."""
    found = dict(built_in)
    for entry in entry_points(group=group):
        found.setdefault(entry.name, entry.value)
    return found


def named_class(
    what: str, name: str, group: str, built_in: Mapping[str, str], base: type[T]
) -> type[T]:
    """Return the class of a name.

    Args:
        what: it is, for people: `driver`.
        name: of the class, as users write it.
        group: of entry points.
        built_in: name -> `module:Class`.
        base: that it must inherit.

    Raises:
        InputError: there is none of this name, or it cannot be used.
    """
    # Scanning the entry points of all installed packages is slow: skip it for built-in classes.
    places = built_in if name in built_in else class_places(group, built_in)
    if name not in places:
        hint = f"{suggestion(name, places)}; a {what} of your own is an installed package with the"
        raise InputError(
            f"there is no {what} {name!r}", f"{hint} entry point `{name}` of `{group}`"
        )
    module, _, attribute = places[name].partition(":")
    try:
        found = getattr(import_module(module), attribute)
    except (Exception, SystemExit) as error:  # a plugin's module may raise any exception
        raise InputError(f"the {what} {name!r} cannot be used: {error}") from error
    if not (isinstance(found, type) and issubclass(found, base)):
        raise InputError(f"the {what} {name!r} cannot be used: it does not inherit {base.__name__}")
    return found
