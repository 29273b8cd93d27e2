"""Live tuning: changes the parameters of running components."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from operator import is_not
from typing import Any, Protocol, cast

from stack.errors import ParameterError
from stack.parameters import check_relations, declarations, suggestion, values_of
from stack.types import ParameterInfo, ParameterTable


class Tunable(Protocol):
    """A running component whose parameters, a frozen dataclass, may change between two steps."""

    @property
    def parameters(self) -> Any:
        """The current ones."""

    def configure(self, parameters: Any) -> None:
        """Apply new ones."""


class LiveParameters:
    """The current parameters of running components by their full names.

    Every snapshot contains them, so they are collected again only after a change, in a new mapping.

    Args:
        tunables: the components by name.
        emit: called with (kind, text, **fields) for each change.

    Attributes:
        table: what the parameters are, with their values at the begin.
    """

    def __init__(self, tunables: Mapping[str, Tunable], emit: Callable[..., None]) -> None:
        self._tunables, self._emit = tunables, emit
        self._collected: list[Any] = []
        self._named: dict[str, Any] = {}
        self.table = ParameterTable(tuple(self._described()))

    def current(self) -> Mapping[str, Any]:
        """Values by full name, e.g. `controller.cruise_speed`."""
        parameters = [tunable.parameters for tunable in self._tunables.values()]
        known = len(parameters) == len(self._collected)
        if not known or any(map(is_not, parameters, self._collected)):
            self._collected = parameters
            self._named = {
                f"{component}.{name}": value
                for component, instance in zip(self._tunables, parameters, strict=True)
                for name, value in values_of(instance).items()
            }
        return self._named

    def _described(self) -> Iterator[ParameterInfo]:
        present = self.current()
        for component, tunable in self._tunables.items():
            for name, item in declarations(cast("type", type(tunable.parameters))).items():
                full = f"{component}.{name}"
                yield ParameterInfo(
                    full, item.type_name(), item.unit, item.range_text(), item.help, item.public,
                    present[full],
                )  # fmt: skip

    def change(self, name: str, raw: Any) -> None:
        """Set a parameter, from the next step on.

        Raises:
            ParameterError: unknown component or parameter, or an invalid value, also beside the
                others.
        """
        value = _changed(self._tunables, name, raw)
        self._emit("parameter", f"{name} is now {value}", name=name, value=str(value))

    def follow(self, settings: Mapping[str, Any]) -> None:
        """Set parameters by full name; None: the value that it had at the begin.

        Raises:
            ParameterError: as `change`.
        """
        for name, value in settings.items():
            begin = next((it.start for it in self.table.parameters if it.name == name), None)
            self.change(name, begin if value is None else value)


def _changed(tunables: Mapping[str, Tunable], name: str, raw: Any) -> Any:
    """Set a parameter; return the value as read."""
    component, _, parameter = name.partition(".")
    if component not in tunables:
        raise ParameterError(
            name, f"unknown component {component!r}", suggestion(component, tunables)
        )
    parameters = tunables[component].parameters
    kind: type = type(parameters)
    declared = declarations(kind)
    if parameter not in declared:
        raise ParameterError(
            name, f"{component} has no parameter {parameter!r}", suggestion(parameter, declared)
        )
    value = declared[parameter].read(raw)
    changed = replace(parameters, **{parameter: value})
    check_relations(changed, {parameter})
    tunables[component].configure(changed)
    return value
