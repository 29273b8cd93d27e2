"""Self-documenting settings: declarations of component parameters and behaviour ports.

A declaration has type, unit, range and a help text. It is the source of the checks of mission,
world and robot files, of `treepilot describe`, of the documentation tables and of live tuning.

    @dataclass(frozen=True)
    class PurePursuitParameters:
        cruise_speed: float = parameter(0.5, "m/s", at_least=0.0, help="speed on a clear path")
"""

from __future__ import annotations

import dataclasses
import re
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from math import isfinite, pi
from typing import Any, TypeVar

import numpy as np

from stack.errors import ParameterError
from stack.types import Path, Pose2D, wrap_angle

T = TypeVar("T")


class _Required:
    """Type of the marker for a missing default."""

    def __repr__(self) -> str:
        return "REQUIRED"


REQUIRED: Any = _Required()
"""Default of a declaration whose value is required."""

EXACT = 2**53
"""Every whole number up to this one has an exact floating-point value."""
_EXACT_HINT = f"numbers other than whole numbers are exact up to {EXACT}"

FARTHEST = 1e6
"""Metres: largest coordinate of a pose."""

_UNITS: dict[str, tuple[str, float]] = {
    "m": ("m", 1.0), "cm": ("m", 0.01), "mm": ("m", 0.001), "km": ("m", 1000.0),
    "s": ("s", 1.0), "ms": ("s", 0.001), "min": ("s", 60.0), "h": ("s", 3600.0),
    "rad": ("rad", 1.0), "deg": ("rad", pi / 180.0), "turn": ("rad", 2.0 * pi),
    "m/s": ("m/s", 1.0), "cm/s": ("m/s", 0.01), "km/h": ("m/s", 1.0 / 3.6),
    "rad/s": ("rad/s", 1.0), "deg/s": ("rad/s", pi / 180.0),
    "m/s²": ("m/s²", 1.0), "m/s2": ("m/s²", 1.0), "m/s^2": ("m/s²", 1.0),
    "rad/s²": ("rad/s²", 1.0), "rad/s2": ("rad/s²", 1.0), "deg/s²": ("rad/s²", pi / 180.0),
    "Hz": ("Hz", 1.0), "kHz": ("Hz", 1000.0), "%": ("", 0.01), "kg": ("kg", 1.0),
    "g": ("kg", 0.001), "V": ("V", 1.0), "W": ("W", 1.0), "Wh": ("Wh", 1.0),
    "px": ("px", 1.0), "N": ("N", 1.0),
}  # fmt: skip
_ELSEWHERE = {
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sek", "sekunden"), "s"),
    **dict.fromkeys(("mins", "minute", "minutes", "minuten"), "min"),
    **dict.fromkeys(("hour", "hours", "hr", "std", "stunden"), "h"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("°", "degree", "degrees", "grad"), "deg"),
    **dict.fromkeys(("kmh", "kph", "km/hr"), "km/h"),
    **dict.fromkeys(("mps", "m/sec"), "m/s"),
    **dict.fromkeys(("radian", "radians"), "rad"),
}
"""Other spellings of units, in lower case -> the unit."""
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*?)?\s*")


@dataclass(frozen=True, slots=True)
class Declaration:
    """Declaration of a parameter, port, argument or file key: type, unit, default and range.

    Attributes:
        name: as written in files.
        type: float, int, bool, str, Pose2D, Expression, Assignments, a dataclass of `parameter`
            fields (written as a mapping), a list of those, X | None.
        help: one sentence.
        unit: SI unit of a float ("" for a plain number); durations are floats in "s".
        default: REQUIRED if there is none.
        at_least: inclusive lower bound of numbers.
        at_most: inclusive upper bound of numbers.
        above: exclusive lower bound of numbers.
        one_of: the allowed texts; empty if any text is allowed.
    """

    name: str
    type: Any
    help: str = ""
    unit: str = ""
    default: Any = REQUIRED
    at_least: float | None = None
    at_most: float | None = None
    above: float | None = None
    one_of: tuple[str, ...] = ()

    @property
    def required(self) -> bool:
        """Whether the value is required."""
        return self.default is REQUIRED

    def type_name(self) -> str:
        """Name of the type for users: number, list of Pose, text…"""
        return type_name(self.type, self.unit)

    def range_text(self) -> str:
        """The allowed values as text, such as `> 0 and <= 1`; empty without a restriction."""
        if self.one_of:
            return " | ".join(self.one_of)
        parts = []
        if self.above is not None:
            parts.append(f"> {self.above:g}")
        if self.at_least is not None:
            parts.append(f">= {self.at_least:g}")
        if self.at_most is not None:
            parts.append(f"<= {self.at_most:g}")
        return " and ".join(parts)

    def read(self, raw: Any) -> Any:
        """Convert a raw value of a file to the declared type and check it.

        Raises:
            ParameterError: wrong type, unit or range; quotes the value and what was expected.
        """
        value = _convert(self, self.type, raw)
        self.check(value)
        return value

    def check(self, value: Any) -> None:
        """Check that the value is within the declared range.

        Raises:
            ParameterError: it is not.
        """
        for item in value if isinstance(value, list | tuple) else (value,):
            if self.one_of and item is not None and item not in self.one_of:
                raise ParameterError(
                    self.name, f"{item!r} is not one of {', '.join(self.one_of)}",
                    suggestion(str(item), self.one_of),
                )  # fmt: skip
            if isinstance(item, int | float) and not isinstance(item, bool):
                self._check_number(item)

    def _check_number(self, number: float) -> None:
        unit = f" {self.unit}" if self.unit else ""
        if self.above is not None and not number > self.above:
            raise ParameterError(self.name, f"{number:g}{unit} must be above {self.above:g}{unit}")
        if self.at_least is not None and not number >= self.at_least:
            raise ParameterError(
                self.name, f"{number:g}{unit} must be at least {self.at_least:g}{unit}"
            )
        if self.at_most is not None and not number <= self.at_most:
            raise ParameterError(
                self.name, f"{number:g}{unit} must be at most {self.at_most:g}{unit}"
            )


def parameter(  # noqa: PLR0913 - the attributes of a declaration
    default: T, unit: str = "", *, help: str, at_least: float | None = None,
    at_most: float | None = None, above: float | None = None, one_of: tuple[str, ...] = (),
) -> T:  # fmt: skip
    """Define a dataclass field with a declaration."""
    declared = Declaration("", None, help, unit, default, at_least, at_most, above, one_of)
    return dataclasses.field(default=default, metadata={"declaration": declared})


@lru_cache(maxsize=256)
def declarations(parameters: type) -> dict[str, Declaration]:
    """The declarations of a parameter dataclass, in the order of its fields."""
    hints = typing.get_type_hints(parameters)
    return {
        item.name: dataclasses.replace(
            item.metadata["declaration"], name=item.name, type=hints[item.name]
        )
        for item in dataclasses.fields(parameters)
        if "declaration" in item.metadata
    }


def build(parameters: type[T], values: Mapping[str, Any]) -> T:
    """Construct a parameter dataclass from raw values; each is converted and checked.

    Raises:
        ParameterError: an unknown name (with the most similar known one) or a wrong value.
    """
    known = declarations(typing.cast("type", parameters))
    checked = {}
    for name, raw in values.items():
        if name not in known:
            # YAML keys inside a component's value may be null or a number.
            hint = suggestion(str(name), known)
            if name in MOVED and RENAMED.get(name) not in known:
                hint = f"write `{MOVED[name]}`"
            raise ParameterError(str(name), f"there is no parameter {name!r} here", hint)
        checked[name] = known[name].read(raw)
    return parameters(**checked)


RENAMED = {
    "localisation.quality": "localisation.health",
    "lost_quality": "lost_health",
    "min_quality": "min_health",
    "quality_window": "health_window",
    "goal_position": "stop_distance",
    "goal_heading": "turn_precision",
}
"""Renamed names of mission and parameter files: old -> new (CHANGELOG.md)."""

MOVED = {
    "goal_position": "goal_checker: {position: …}",
    "goal_heading": "goal_checker: {heading: …}",
    "goal_settle": "goal_checker: {settle: …}",
    "progress_distance": "progress_checker: {distance: …}",
    "progress_angle": "progress_checker: {angle: …}",
    "progress_time": "progress_checker: {time: …}",
    "lost_health": "localisation: {use: mcl, lost_health: …}",
    "patience": "navigator: {replan_patience: …}",
}
"""Parameters that belong to another component now: old name -> what to write."""


def suggestion(word: str, known: typing.Iterable[str]) -> str:
    """Hint for an unknown word: its new name, the most similar word, or all known words."""
    names = sorted(known)
    if RENAMED.get(word) in names:
        return f"{word!r} was renamed to {RENAMED[word]!r}"
    close = nearest(word, names)
    if close is not None:
        return f"did you mean {close!r}?"
    return f"available: {', '.join(names)}" if names else "none are available"


def nearest(word: str, known: typing.Sequence[str]) -> str | None:
    """The known name most similar to a misspelt word; None if none is similar.

    A unique prefix takes precedence: `init` gives `initial`, not `unit`.
    """
    longer = [name for name in known if len(word) > 2 and name.startswith(word)]
    if len(longer) == 1:
        return longer[0]
    return next(iter(get_close_matches(word, sorted(known), n=1, cutoff=0.6)), None)


def read_quantity(text: str, unit: str) -> float:
    """Convert a number with optional unit to SI: ("30 cm", "m") gives 0.3.

    Raises:
        ParameterError: the text is not a number, its unit is unknown or of another dimension.
    """
    match = _QUANTITY.fullmatch(text)
    if not match:
        example = _EXAMPLES.get(unit)
        hint = f"write a number with a unit: {example}" if example else "write digits: 5"
        raise ParameterError("", f"expected {_number_words(unit)}, got {text!r}", hint)
    number, written = _exact(match[1]), match[2]
    if written is None:
        value = number
    else:
        if written not in _UNITS:
            hint = _units_hint(unit)
            comma = re.fullmatch(r",(\d+)\s*(.*)", written)
            if comma:
                hint = f"write a decimal point: {match[1]}.{comma[1]} {comma[2]}".rstrip()
            elif _ELSEWHERE.get(written.lower()):
                hint = f"write {match[1]} {_ELSEWHERE[written.lower()]}"
            raise ParameterError("", f"unknown unit {written!r} in {text!r}", hint)
        dimension, factor = _UNITS[written]
        if dimension != unit:
            raise ParameterError(
                "", f"{text!r} is in {written}, expected {_number_words(unit)}", _units_hint(unit)
            )
        value = number * factor
    if not isfinite(value):
        raise ParameterError("", f"{text!r} is not a finite number")
    return value


_EXAMPLES = {
    "m": "50 cm", "s": "5 s", "rad": "90 deg", "m/s": "0.3 m/s", "rad/s": "45 deg/s",
    "m/s²": "0.5 m/s²", "Hz": "10 Hz",
}  # fmt: skip
_HEADINGS = ("heading", "theta", "yaw", "angle")
_DIGITS = re.compile(r"[-+]?\d+(?:\.0*)?")


def _exact(numeral: str) -> float:
    """Convert a numeral; a whole number that would become another number is refused.

    Raises:
        ParameterError: the number exceeds 2^53 and has no exact floating-point value.
    """
    number = float(numeral)
    whole = numeral.partition(".")[0]
    if abs(number) >= EXACT and _DIGITS.fullmatch(numeral):
        if not isfinite(number) or len(whole) > 400 or int(number) != int(whole):
            raise ParameterError("", f"{_shown(numeral)} cannot be stored exactly", _EXACT_HINT)
    return number


def quantity_unit(text: str) -> str | None:
    """The unit of a number with a unit, such as "30 cm"; None for any other text."""
    match = _QUANTITY.fullmatch(text)
    return match[2] if match and match[2] in _UNITS else None


def units() -> Mapping[str, tuple[str, float]]:
    """The units allowed in files: unit -> (SI unit of its dimension, factor)."""
    return types.MappingProxyType(_UNITS)


def type_name(kind: Any, unit: str = "") -> str:
    """Name of a type for users: number, list of Pose, text…"""
    origin = typing.get_origin(kind)
    if origin is list or origin is tuple:
        inner = typing.get_args(kind)
        return f"list of {type_name(inner[0], unit)}" if inner else "list"
    if origin in (typing.Union, types.UnionType):
        return type_name(_without_none(kind), unit)
    if kind is float:
        return {"s": "duration", "": "number"}.get(unit, f"number in {unit}")
    plain = {int: "whole number", bool: "true or false", str: "text", Pose2D: "Pose"}
    return plain.get(kind) or str(getattr(kind, "__name__", kind))


def _without_none(kind: Any) -> Any:
    return next(arm for arm in typing.get_args(kind) if arm is not type(None))


def _number_words(unit: str) -> str:
    return {"s": "a duration", "": "a number", "rad": "an angle", "m": "a length"}.get(
        unit, f"a number in {unit}"
    )


def _units_hint(unit: str) -> str:
    units = [name for name, (dimension, _) in _UNITS.items() if dimension == unit]
    return f"allowed units: {', '.join(units)}" if units else "no unit is allowed here"


def _convert(declared: Declaration, kind: Any, raw: Any) -> Any:
    """Convert a raw value to `kind`, or raise ParameterError with the declaration's name."""
    try:
        return _converted(kind, declared.unit, raw)
    except ParameterError as error:
        raise ParameterError(declared.name, error.sentence, error.hint) from None


def _converted(kind: Any, unit: str, raw: Any) -> Any:  # noqa: C901 - one branch per type
    if kind is typing.Any or kind is object:
        return raw
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        return None if raw is None else _converted(_without_none(kind), unit, raw)
    unchecked = not isinstance(kind, type) and origin not in (list, tuple)
    if unchecked or kind in (typing.Any, object):
        return raw
    if isinstance(kind, type) and _is_instance(raw, kind):
        if kind is float and not isfinite(raw):
            raise ParameterError("", f"{raw!r} is not a finite number")
        return raw
    if kind is float:
        if isinstance(raw, int) and not isinstance(raw, bool):
            return _exact(str(raw))
        if isinstance(raw, str):
            return read_quantity(raw, unit)
    if kind is Pose2D and isinstance(raw, list | tuple):
        return _pose(raw)
    if kind is Path and isinstance(raw, list | tuple):
        return _path(raw)
    if isinstance(raw, Mapping) and has_fields(kind):
        return _fields_of(kind, raw)
    if origin in (list, tuple):
        return _items(typing.get_args(kind)[0], unit, raw)
    words: dict[Any, str] = {
        bool: "true or false",
        int: "a whole number",
        str: "text",
        float: _number_words(unit),
        Pose2D: "a pose [x, y, heading]",
        Path: "a path [[x, y], [x, y], …]",
    }
    expected = words.get(kind, f"a {getattr(kind, '__name__', kind)}")
    if has_fields(kind):
        expected += f" {{{', '.join(declarations(kind))}}}"
    hint = ""
    if kind is Pose2D and isinstance(raw, Mapping) and {"x", "y"} <= raw.keys():
        heading = next((raw[name] for name in _HEADINGS if name in raw), None)
        values = [raw["x"], raw["y"], *([] if heading is None else [heading])]
        hint = f"write [{', '.join(map(str, values))}]"
    if kind is Pose2D and isinstance(raw, str) and raw.count(",") in (1, 2) and raw[:1].isdigit():
        hint = f"write [{raw}]"
    raise ParameterError("", f"expected {expected}, got {_shown(raw)}", hint)


def has_fields(kind: Any) -> bool:
    """Whether a type is a dataclass of `parameter` fields, which files write as a mapping."""
    return isinstance(kind, type) and dataclasses.is_dataclass(kind) and bool(declarations(kind))


def _fields_of(kind: Any, raw: Mapping[str, Any]) -> Any:
    try:
        return build(kind, raw)
    except ParameterError as error:
        raise ParameterError("", str(error), error.hint) from None


def _items(inner: Any, unit: str, raw: Any) -> list[Any]:
    if not isinstance(raw, list | tuple):
        raise ParameterError("", f"expected a list, got {_shown(raw)}")
    return [_converted(inner, unit, item) for item in raw]


def _is_instance(raw: Any, kind: type) -> bool:
    if isinstance(raw, bool):
        return kind is bool
    return isinstance(raw, kind)


def _path(raw: list[Any] | tuple[Any, ...]) -> Path:
    """Return a path; a pose without a heading gets that of the next segment."""
    if len(raw) < 2:
        raise ParameterError("", f"a path has at least 2 poses, got {len(raw)}")
    for item in raw:
        if not isinstance(item, list | tuple):
            raise ParameterError("", f"a path is a list of poses, got {_shown(item)} in it")
    points = np.array([(pose.x, pose.y, pose.heading) for pose in map(_pose, raw)])
    steps = np.diff(points[:, :2], axis=0)
    along = np.arctan2(steps[:, 1], steps[:, 0])
    for number, item in enumerate(raw):
        if len(item) == 2:
            points[number, 2] = along[min(number, len(along) - 1)]
    return Path(points)


def _pose(raw: list[Any] | tuple[Any, ...]) -> Pose2D:
    if len(raw) not in (2, 3):
        whole = all(isinstance(item, int) for item in raw)
        hint = "leave out what is more, for example z: the third number is the heading"
        if len(raw) in (4, 6) and whole:
            hint = "write decimals with a point: 2.5"
        elif len(raw) < 2:
            hint = "write [x, y]"
        raise ParameterError("", f"a pose is [x, y] or [x, y, heading], got {_shown(raw)}", hint)
    x, y = (_converted(float, "m", item) for item in raw[:2])
    heading = _converted(float, "rad", raw[2]) if len(raw) == 3 else 0.0
    if max(abs(x), abs(y)) > FARTHEST:
        raise ParameterError("", f"({x:g}, {y:g}) m is farther than {FARTHEST:g} m from the origin")
    if abs(heading) > 2.0 * pi + 1e-9:  # almost certainly degrees
        sentence = f"a heading of {heading:g} rad is more than a full turn"
        raise ParameterError("", sentence, f"write {raw[2]:g} deg" if _is_number(raw[2]) else "")
    return Pose2D(x, y, wrap_angle(heading))


def _is_number(raw: Any) -> bool:
    return isinstance(raw, int | float) and not isinstance(raw, bool)


def _shown(raw: Any) -> str:
    if raw is None:
        return "nothing"
    text = {True: "true", False: "false"}[raw] if isinstance(raw, bool) else repr(raw)
    return text if len(text) <= 60 else text[:57] + "..."
