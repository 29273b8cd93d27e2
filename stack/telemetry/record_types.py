"""The types of measurements that the sensor log can hold: built-in ones and those of packages.

A package registers a frozen dataclass with a `stamp` in the entry-point group of GROUP, under the
name of the class. Its fields are numbers, texts, NumPy arrays, tuples of numbers and texts, and
such dataclasses: the log stores and restores them by their annotations.
"""

from __future__ import annotations

from dataclasses import is_dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import Any, get_type_hints

from stack.errors import InputError
from stack.types import (
    Battery,
    DepthImage,
    GripperState,
    Image,
    Imu,
    JointState,
    Odometry,
    RangeReading,
    Scan,
)

GROUP = "treepilot.records"

BUILT_IN: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        Scan, RangeReading, Odometry, Imu, Image, DepthImage, Battery, JointState, GripperState,
    )
}  # fmt: skip


def record_type(name: str) -> type:
    """Return the type of measurements with a name.

    Raises:
        InputError: no installed package registers it, or it cannot be used.
    """
    return BUILT_IN[name] if name in BUILT_IN else _plugged(name)


@cache
def _plugged(name: str) -> type:
    entry = next(iter(entry_points(group=GROUP, name=name)), None)
    if entry is None:
        raise InputError(
            f"there is no type of measurements {name!r}; install the package that registers it in"
            f" the entry points {GROUP}"
        )
    what = f"the type of measurements {name!r}"
    try:
        found: Any = entry.load()
        hints = get_type_hints(found)
    except Exception as error:  # a plugin's module may raise any exception
        raise InputError(f"{what} cannot be used: {error}") from error
    if not (isinstance(found, type) and is_dataclass(found)):
        raise InputError(f"{what} cannot be used: it is not a dataclass")
    if found.__name__ != name:
        raise InputError(f"{what} cannot be used: its class is called {found.__name__!r}")
    if hints.get("stamp") is not float:
        raise InputError(f"{what} cannot be used: it has no field `stamp: float`")
    return found
