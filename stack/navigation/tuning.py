"""Changing the parameters of components while they run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from stack.errors import ParameterError
from stack.parameters import declarations, suggestion


@dataclass(frozen=True, slots=True)
class Tunable:
    """A component's parameters as they are now, and what makes others take effect.

    Attributes:
        read: returns the frozen dataclass in force.
        apply: puts another in force; called between two steps.
    """

    read: Callable[[], Any]
    apply: Callable[[Any], None]

    @staticmethod
    def of(component: Any) -> Tunable:
        """For a component with `parameters` that has `configure`, or lets them be set."""
        configure = getattr(component, "configure", None)

        def assign(parameters: Any) -> None:
            component.parameters = parameters

        return Tunable(lambda: component.parameters, configure or assign)


def flat(tunables: Mapping[str, Tunable]) -> dict[str, Any]:
    """The parameters in force by their full names: `controller.cruise_speed`."""
    return {
        f"{name}.{item.name}": getattr(parameters, item.name)
        for name, tunable in tunables.items()
        for parameters in [tunable.read()]
        for item in fields(parameters)
    }


def change(tunables: Mapping[str, Tunable], name: str, raw: Any) -> Any:
    """Put another value in force; returns it as it was read.

    Raises:
        ParameterError: no such component or parameter, or a value that will not do.
    """
    component, _, parameter = name.partition(".")
    if component not in tunables:
        raise ParameterError(
            name, f"there is no component {component!r}", suggestion(component, tunables)
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
