"""The kinds of faults by name, found in the package `kinds`."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from stack.errors import InputError
from stack.parameters import suggestion
from stack.sim.faults import kinds
from stack.sim.faults.fault import Fault


def fault_names() -> list[str]:
    """Return the names of all kinds, sorted."""
    return sorted(module.name for module in iter_modules(kinds.__path__))


@cache
def fault_kind(name: str) -> type[Fault]:
    """Return a kind.

    Raises:
        InputError: there is none of this name.
    """
    if name not in fault_names():
        raise InputError(f"there is no fault {name!r}", suggestion(name, fault_names()))
    module = import_module(f"{kinds.__name__}.{name}")
    here = [
        item for item in vars(module).values()
        if isinstance(item, type) and issubclass(item, Fault) and item.__module__ == module.__name__
    ]  # fmt: skip
    return here[0]


def summary_of(kind: type[Fault]) -> str:
    """Return what a kind is, in a line."""
    return (kind.__doc__ or "").strip().partition("\n")[0]
