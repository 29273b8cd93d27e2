"""Parameters to try: each with a range or a list of values, checked before any run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, isfinite
from typing import Any, cast

from missions.execution.prepare import PreparedMission
from stack.components import Choice, available
from stack.documents import value_of
from stack.errors import InputError, ParameterError
from stack.parameters import Declaration, declarations, suggestion

OPTION = "--try"
DIGITS = 4
"""Significant digits of a tried value; runs do not resolve finer differences."""

_SPAN = re.compile(r"(?P<low>.+?)\s*\.\.\s*(?P<high>.+)")


@dataclass(frozen=True)
class Range:
    """A parameter to try: a range of numbers, or a list of values.

    Attributes:
        name: `controller.cruise_speed`.
        low, high: ends, included, in the parameter's unit. whole: only whole numbers.
        values: values as text; empty for a range of numbers.
    """

    name: str
    low: float = 0.0
    high: float = 0.0
    whole: bool = False
    values: tuple[str, ...] = ()

    def text_at(self, share: float) -> str:
        """Return the value at a fraction in [0, 1) of the range, as text."""
        if self.values:
            return self.values[min(floor(share * len(self.values)), len(self.values) - 1)]
        if self.whole:
            steps = self.high - self.low + 1.0
            return f"{min(self.low + floor(share * steps), self.high):.0f}"
        value = float(f"{self.low + share * (self.high - self.low):.{DIGITS}g}")
        return repr(min(max(value, self.low), self.high))

    def share_of(self, text: str) -> float:
        """Return the fraction of a value: the centre of the fractions that give it."""
        if self.values:
            return (self.values.index(text) + 0.5) / len(self.values)
        if self.whole:
            return (float(text) - self.low + 0.5) / (self.high - self.low + 1.0)
        return (float(text) - self.low) / (self.high - self.low)


def read_ranges(given: Mapping[str, str], plan: PreparedMission) -> list[Range]:
    """Read the ranges of the command line and check them against the mission's components.

    Args:
        given: `controller.cruise_speed` -> `0.4..0.8`, `30 cm..80 cm`, `simple,constrained`.
        plan: the mission.

    Raises:
        InputError: unknown parameter, or a value that it does not accept.
    """
    if not given:
        raise InputError(f"nothing to try: use {OPTION}, e.g. controller.cruise_speed=0.4..0.8")
    chosen = [name for name in given if name.endswith(".use")]
    for name in chosen:
        kind = name.partition(".")[0]
        others = [other for other in given if other.startswith(f"{kind}.") and other != name]
        if others:
            raise InputError(
                f"{OPTION} {name}: {others[0]} is not the same parameter for each {kind}; "
                f"try one {kind} at a time"
            )
    return [_range(name, text, plan) for name, text in given.items()]


def _range(name: str, text: str, plan: PreparedMission) -> Range:
    declared = _declared(name, plan)
    span = _SPAN.fullmatch(text)
    if span is None:
        values = tuple(part.strip() for part in text.split(",") if part.strip())
        for value in values:
            _read(declared, name, text, value)
        if len(dict.fromkeys(values)) != len(values) or not values:
            raise InputError(f"{OPTION} {name}={text}: expected LOW..HIGH or distinct values")
        return Range(name, values=values)
    low, high = (_read(declared, name, text, span[end]) for end in ("low", "high"))
    if not all(_is_number(end) for end in (low, high)):
        kind = declared.type_name()
        raise InputError(
            f"{OPTION} {name}={text}: {kind} has no range; list values, as in {name}=a,b"
        )
    if not low < high:
        raise InputError(f"{OPTION} {name}={text}: {low:g} is not below {high:g}")
    whole = isinstance(low, int) and isinstance(high, int)
    return Range(name, float(low), float(high), whole)


def _read(declared: Declaration, name: str, text: str, value: str) -> Any:
    """Return a value as the parameter reads it; errors name the option and the allowed range."""
    try:
        return declared.read(value_of(value))
    except ParameterError as error:
        allowed = declared.range_text()
        hint = error.hint or (f"allowed: {allowed}" if allowed else "")
        raise InputError(
            f"{OPTION} {name}={text}: {error.sentence}" + (f"; {hint}" if hint else "")
        ) from None


def _declared(name: str, plan: PreparedMission) -> Declaration:
    kind, dot, parameter = name.partition(".")
    if not dot or not parameter:
        raise InputError(f"{OPTION} {name}: expected KIND.NAME, e.g. controller.cruise_speed")
    if kind not in plan.choices:
        raise InputError(
            f"{OPTION} {name}: navigation has no {kind!r}; {suggestion(kind, plan.choices)}"
        )
    choice = plan.choices[kind]
    known = declarations(cast("type", type(choice.parameters)))
    if parameter == "use" and choice.name != kind:
        return Declaration("use", str, one_of=_names(choice))
    if parameter not in known:
        raise InputError(
            f"{OPTION} {name}: {choice.name} has no parameter {parameter!r}; "
            f"{suggestion(parameter, known)}"
        )
    return known[parameter]


def _names(choice: Choice) -> tuple[str, ...]:
    return tuple(dict.fromkeys([choice.name, *available(choice.kind)]))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
