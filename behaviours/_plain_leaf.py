"""Any py_trees leaf class as a behaviour: its ports are what its constructor takes."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Mapping
from enum import Enum
from typing import Any

from py_trees.behaviour import Behaviour

from stack.errors import ParameterError
from stack.parameters import REQUIRED, Declaration


def ports(cls: type[Behaviour]) -> dict[str, Declaration]:
    """A declaration for each constructor argument but `name`; an Enum is written as its word."""
    hints = _hints(cls)
    return {
        name: _declaration(name, hints.get(name, Any), argument.default)
        for name, argument in _arguments(cls).items()
        if name != "name"
    }


def build(cls: type[Behaviour], name: str, values: Mapping[str, Any]) -> Behaviour:
    """An instance with these arguments.

    Raises:
        ParameterError: the constructor does not take them.
    """
    hints, arguments = _hints(cls), dict(values)
    for port, value in values.items():
        if _is_enum(hints.get(port)) and isinstance(value, str):
            arguments[port] = hints[port][value.upper()]
    if "name" in _arguments(cls):
        arguments["name"] = name
    try:
        leaf = cls(**arguments)
    except Exception as error:
        raise ParameterError("", f"{cls.__name__} refuses its ports: {error}") from error
    leaf.name = name
    return leaf


def _declaration(name: str, hint: Any, default: Any) -> Declaration:
    words: tuple[str, ...] = ()
    if _is_enum(hint):
        words, hint = tuple(word.lower() for word in hint.__members__), str
        default = default.name.lower() if isinstance(default, Enum) else default
    if default is inspect.Parameter.empty:
        default = REQUIRED
    return Declaration(name, hint, default=default, one_of=words)


def _arguments(cls: type[Behaviour]) -> dict[str, inspect.Parameter]:
    named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    parameters = inspect.signature(cls).parameters
    return {name: item for name, item in parameters.items() if item.kind in named}


def _hints(cls: type[Behaviour]) -> dict[str, Any]:
    """Types of the constructor's arguments; none where they cannot be resolved."""
    try:
        return typing.get_type_hints(cls.__init__)
    except (NameError, TypeError):
        return {}


def _is_enum(hint: Any) -> bool:
    return inspect.isclass(hint) and issubclass(hint, Enum)
