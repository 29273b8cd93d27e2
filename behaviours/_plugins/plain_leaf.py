"""Plain py_trees leaves as behaviours: the constructor arguments are the ports."""

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
    """Return a declaration per constructor argument, `name` excluded; an Enum becomes words."""
    hints = _hints(cls)
    return {
        name: _declaration(name, hints.get(name, Any), argument.default)
        for name, argument in _arguments(cls).items()
        if name != "name"
    }


def build(cls: type[Behaviour], name: str, values: Mapping[str, Any]) -> Behaviour:
    """Construct the leaf with these port values.

    Raises:
        ParameterError: the constructor rejects them.
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
        raise ParameterError("", f"{cls.__name__} rejects its ports: {error}") from error
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
    """Return the types of the constructor arguments; empty if they cannot be resolved."""
    try:
        return typing.get_type_hints(cls.__init__)
    except (NameError, TypeError):
        return {}


def _is_enum(hint: Any) -> bool:
    return inspect.isclass(hint) and issubclass(hint, Enum)
