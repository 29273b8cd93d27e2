"""Live tuning: changes the parameters of running components."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

from stack.errors import ParameterError
from stack.parameters import declarations, suggestion


@dataclass(frozen=True, slots=True)
class Tunable:
    """Access to the parameters of a running component.

    Attributes:
        read: returns the current parameters, a frozen dataclass.
        apply: applies new parameters; called between two steps.
    """

    read: Callable[[], Any]
    apply: Callable[[Any], None]

    @staticmethod
    def of(component: Any) -> Tunable:
        """Create for a component with `parameters` and `configure`."""
        return Tunable(lambda: component.parameters, component.configure)


def flat(tunables: Mapping[str, Tunable]) -> dict[str, Any]:
    """Return the current parameters by their full names, e.g. `controller.cruise_speed`."""
    return {
        full_name: getattr(parameters, field)
        for name, tunable in tunables.items()
        for parameters in [tunable.read()]
        for field, full_name in _names(name, parameters.__class__)
    }


@lru_cache(maxsize=256)
def _names(component: str, kind: type) -> tuple[tuple[str, str], ...]:
    """Field and full name of each parameter; every snapshot needs them."""
    return tuple((item.name, f"{component}.{item.name}") for item in fields(kind))


def change(tunables: Mapping[str, Tunable], name: str, raw: Any) -> Any:
    """Set a parameter; return the value as read.

    Raises:
        ParameterError: unknown component or parameter, or an invalid value.
    """
    component, _, parameter = name.partition(".")
    if component not in tunables:
        raise ParameterError(
            name, f"unknown component {component!r}", suggestion(component, tunables)
        )
    parameters = tunables[component].read()
    kind: type = type(parameters)
    declared = declarations(kind)
    if parameter not in declared:
        raise ParameterError(
            name, f"{component} has no parameter {parameter!r}", suggestion(parameter, declared)
        )
    value = declared[parameter].read(raw)
    tunables[component].apply(replace(parameters, **{parameter: value}))
    return value
