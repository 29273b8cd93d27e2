"""Self-documenting settings: declarations of component parameters and behaviour ports.

A declaration has type, unit, range and a help text. It is the source of the checks of mission,
world and robot files, of `treepilot describe`, of the documentation tables and of live tuning.

    @dataclass(frozen=True)
    class PurePursuitParameters:
        cruise_speed: float = parameter(0.5, "m/s", at_least=0.0, help="speed on a clear path")
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

from stack.errors import ParameterError
from stack.parameters.names import suggestion, write
from stack.parameters.poses import read_path, read_pose
from stack.parameters.quantities import read_number, shown
from stack.types import Path, Pose2D

T = TypeVar("T")


class _Required:
    """Type of the marker for a missing default."""

    def __repr__(self) -> str:
        return "REQUIRED"


REQUIRED: Any = _Required()
"""Default of a declaration whose value is required."""


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
        not_above: another parameter of the same component that the value must not exceed, unless
            that is 0 or None: switched off.
        robot_limit: the field of the robot's `Limits` that limits the value.
        public: a parameter that users may need; the others are for experts and set in the same way,
            but listed only on request.
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
    not_above: str = ""
    robot_limit: str = ""
    public: bool = False

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
        try:
            value = _converted(self.type, self.unit, raw)
        except ParameterError as error:
            raise ParameterError(self.name, error.sentence, error.hint) from None
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
    not_above: str = "", robot_limit: str = "", public: bool = False,
) -> T:  # fmt: skip
    """Define a dataclass field with a declaration."""
    declared = Declaration(
        "", None, help, unit, default, at_least, at_most, above, one_of, not_above, robot_limit,
        public,
    )  # fmt: skip
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


def values_of(instance: Any) -> dict[str, Any]:
    """The values of a dataclass's fields by name; values are neither copied nor converted."""
    return {item.name: getattr(instance, item.name) for item in dataclasses.fields(instance)}


def check_relations(instance: Any, written: Collection[str]) -> None:
    """Check that no parameter is above the one that it is declared `not_above`.

    Args:
        instance: of a parameter dataclass.
        written: the parameters that a user has set: one of them is named.

    Raises:
        ParameterError: one is; quotes both values.
    """
    kind: type = type(instance)
    declared, values = declarations(kind), values_of(instance)
    for low in declared.values():
        if not low.not_above:
            continue
        high = declared[low.not_above]
        least, most = values[low.name], values[high.name]
        if least is None or not most or least <= most:
            continue
        lower, higher = _with_unit(least, low.unit), _with_unit(most, high.unit)
        if low.name in written or high.name not in written:
            sentence, hint = f"{lower} is above {high.name} {higher}", f"use at most {higher}"
            raise ParameterError(low.name, sentence, f"{hint}, or a higher {high.name}")
        sentence, hint = f"{higher} is less than {low.name} {lower}", f"use at least {lower}"
        raise ParameterError(high.name, sentence, f"{hint}, or a lower {low.name}")


def _with_unit(number: float, unit: str) -> str:
    return f"{number:g} {unit}".rstrip()


def refuse_changes(names: Iterable[str], former: Any, new: Any) -> None:
    """Check that these parameters are the same in two instances of a parameter dataclass.

    Raises:
        ParameterError: one differs.
    """
    before, after = values_of(former), values_of(new)
    for name in names:
        if after[name] != before[name]:
            raise ParameterError(name, "cannot be changed during a run")


def build(parameters: type[T], values: Mapping[str, Any]) -> T:
    """Construct a parameter dataclass from raw values; each is converted and checked.

    Raises:
        ParameterError: an unknown name (with the most similar known one), a required one that is
            missing, a wrong value, or two values that contradict each other.
    """
    known = declarations(typing.cast("type", parameters))
    checked = {}
    for name, raw in values.items():
        if name not in known:
            # YAML keys inside a component's value may be null or a number.
            hint = suggestion(str(name), known)
            raise ParameterError(str(name), f"there is no parameter {name!r} here", hint)
        checked[name] = known[name].read(raw)
    for name, declared in known.items():
        if declared.required and name not in checked:
            raise ParameterError(name, "is required", declared.help)
    instance = parameters(**checked)
    check_relations(instance, checked)
    return instance


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
    return plain.get(kind) or (kind.__name__ if isinstance(kind, type) else str(kind))


def _without_none(kind: Any) -> Any:
    return next(arm for arm in typing.get_args(kind) if arm is not type(None))


_SWITCHES = {"yes": "true", "on": "true", "1": "true", "no": "false", "off": "false", "0": "false"}
"""Other words for true and false, which YAML 1.2 reads as texts."""


def _converted(kind: Any, unit: str, raw: Any) -> Any:  # noqa: C901 - one branch per type
    if kind is typing.Any or kind is object:
        return raw
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        return None if raw is None else _converted(_without_none(kind), unit, raw)
    if not isinstance(kind, type) and origin not in (list, tuple):
        return raw
    if kind is float:
        return read_number(raw, unit)
    if isinstance(kind, type) and _is_instance(raw, kind):
        return raw
    if kind is Pose2D:
        return read_pose(raw)
    if kind is Path:
        return read_path(raw)
    if isinstance(raw, Mapping) and has_fields(kind):
        return _fields_of(kind, raw)
    if origin in (list, tuple):
        return _items(typing.get_args(kind)[0], unit, raw)
    words: dict[Any, str] = {bool: "true or false", int: "a whole number", str: "text"}
    expected = words.get(kind, f"a {kind.__name__ if isinstance(kind, type) else kind}")
    meant = _SWITCHES.get(str(raw).lower()) if kind is bool else None
    if meant:
        raise ParameterError("", f"expected {expected}, got {shown(raw)}", write(meant))
    if has_fields(kind):
        expected += f" {{{', '.join(declarations(kind))}}}"
    raise ParameterError("", f"expected {expected}, got {shown(raw)}")


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
        raise ParameterError("", f"expected a list, got {shown(raw)}")
    return [_converted(inner, unit, item) for item in raw]


def _is_instance(raw: Any, kind: type) -> bool:
    if isinstance(raw, bool):
        return kind is bool
    return isinstance(raw, kind)
