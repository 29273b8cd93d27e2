"""Types that a port can have: those that can be written in a mission file."""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping
from typing import Any

from stack.errors import ParameterError
from stack.parameters import REQUIRED, Declaration, has_fields
from stack.types import Assignments, Expression, Path, Pose2D

SCALARS = (float, int, bool, str, Pose2D, Path)


def check_ports(ports: Mapping[str, Declaration]) -> None:
    """Raise ParameterError if a port has an unsupported type or an invalid default."""
    for declared in ports.values():
        if not _writable(declared.type):
            kind = declared.type.__name__ if isinstance(declared.type, type) else declared.type
            raise ParameterError(
                f"port {declared.name}",
                f"a mission file cannot write a value of type {kind}; use float, int, bool, str, "
                "Pose2D, Path, Expression, a dataclass of parameter() fields, a list of those, or "
                "one of those | None",
            )
        if declared.default is REQUIRED:
            continue
        if declared.default is None:
            if not _optional(declared.type):
                sentence = "the default is None, so its type must end in | None"
                raise ParameterError(f"port {declared.name}", sentence)
        elif declared.type not in (Expression, Assignments):
            _check_default(declared)


def _check_default(declared: Declaration) -> None:
    try:
        declared.read(declared.default)
    except ParameterError as error:
        raise ParameterError(
            f"port {declared.name}", f"invalid default: {error.sentence}"
        ) from None


def _writable(kind: Any) -> bool:
    if kind in (*SCALARS, Expression, Assignments) or has_fields(kind):
        return True
    if typing.get_origin(kind) is list:
        return all(_writable(inner) for inner in typing.get_args(kind))
    if _optional(kind):
        return all(_writable(arm) for arm in typing.get_args(kind) if arm is not types.NoneType)
    return False


def _optional(kind: Any) -> bool:
    """Return whether the type is X | None, with a single X."""
    arms = typing.get_args(kind)
    union = typing.get_origin(kind) in (typing.Union, types.UnionType)
    return union and len(arms) == 2 and types.NoneType in arms
