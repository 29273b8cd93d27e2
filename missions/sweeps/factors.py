"""Factors of a sweep: settings with a list of values, or with a distribution."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, floor, log
from statistics import NormalDist
from typing import Any

from stack.errors import InputError
from stack.telemetry.codec import from_plain, plain_fields

DIGITS = 6
"""Significant digits of a drawn value: enough for a run, and short enough to be typed again."""

END_DIGITS = 12
"""Of the ends of a normal distribution: without the last bits of their arithmetic."""

CUT = 3.0
"""Deviations at which a normal distribution is cut, so that its values have bounds to check."""

LIST, UNIFORM, LOGUNIFORM, NORMAL = "list", "uniform", "loguniform", "normal"

EXAMPLE = (
    "write a list, a,b,c, a range, LOW..HIGH or uniform(LOW, HIGH), or loguniform(LOW, HIGH),"
    " normal(MEAN, DEV)"
)

Value = int | float | bool | str
"""Value of a factor in a table."""

_DISTRIBUTION = re.compile(r"(uniform|loguniform|normal)\s*\((.*)\)")
_SPAN = re.compile(r"([^,({\[]+?)\s*\.\.\s*([^,)}\]]+)")
_OTHER_CALL = re.compile(r"([a-z_]+)\s*\(.*\)")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*?)?\s*")


@dataclass(frozen=True, slots=True)
class Factor:
    """A setting that varies.

    Attributes:
        name: `controller.cruise_speed`, an argument, `world`, `robot` or `start`.
        kind: list | uniform | loguniform | normal.
        values: of a list, as text.
        low, high: ends of a distribution, in its unit; mean and deviation of a normal one.
        unit: as written after both numbers; may be empty.
        whole: whether only whole numbers are drawn.
    """

    name: str
    kind: str = LIST
    values: tuple[str, ...] = ()
    low: float = 0.0
    high: float = 0.0
    unit: str = ""
    whole: bool = False

    @property
    def is_list(self) -> bool:
        """Whether it has a list of values."""
        return self.kind == LIST

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value of a distribution."""
        if self.kind != NORMAL:
            return self.low, self.high
        reach = CUT * self.high
        return _rounded(self.low - reach, END_DIGITS), _rounded(self.low + reach, END_DIGITS)

    @property
    def probes(self) -> tuple[str, ...]:
        """Values to try on the mission: the listed ones, or the ends."""
        return self.values if self.is_list else tuple(map(self._text, self.ends))

    def at(self, share: float) -> str:
        """Return the value below which a share of all values lies, as text.

        Args:
            share: in [0, 1).
        """
        if self.is_list:
            return self.values[min(floor(share * len(self.values)), len(self.values) - 1)]
        beyond = 0.5 if self.whole else 0.0  # so that the ends are drawn as often as the others
        low, high = self.ends[0] - beyond, self.ends[1] + beyond
        if self.kind == LOGUNIFORM:
            number = exp(log(low) + share * (log(high) - log(low)))
        elif self.kind == NORMAL:
            normal = NormalDist(self.low, self.high)
            first, last = normal.cdf(low), normal.cdf(high)
            number = normal.inv_cdf(first + share * (last - first))
        else:
            number = low + share * (high - low)
        return self.text(floor(number + 0.5) if self.whole else number)

    def text(self, number: float) -> str:
        """Return a number of a distribution as a value: rounded, and not beyond the ends."""
        number = number if self.whole else _rounded(number, DIGITS)
        return self._text(min(max(number, self.ends[0]), self.ends[1]))

    def typed(self, text: str) -> Value:
        """Return a value for a table: a number if all values are numbers of one unit, else text."""
        if not self.is_list:
            return int(_number(text)[0]) if self.whole else _number(text)[0]
        if all(value in ("true", "false") for value in self.values):
            return text == "true"
        parts = [_NUMBER.fullmatch(value) for value in self.values]
        if any(part is None for part in parts) or len({part[2] for part in parts if part}) > 1:
            return text
        numbers = [part[1] for part in parts if part]
        is_whole = all(re.fullmatch(r"[-+]?\d{1,18}", number) for number in numbers)
        return int(_number(text)[0]) if is_whole else _number(text)[0]

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        return plain_fields(self)

    @classmethod
    def read(cls, plain: dict[str, Any]) -> Factor:
        """Return a factor from the values of its JSON.

        Raises:
            LookupError, TypeError, MalformedError: they are not those of a factor.
        """
        return from_plain(cls, plain)

    def _text(self, number: float) -> str:
        shown = f"{number:.0f}" if self.whole else repr(number).removesuffix(".0")
        return f"{shown} {self.unit}".rstrip()


def read_factor(name: str, text: str) -> Factor:
    """Read the values of a factor: `a,b,c`, `uniform(0.4, 0.8)`, or the same as `0.4..0.8`.

    Raises:
        InputError: it is neither; the sentence does not name the factor.
    """
    span = _SPAN.fullmatch(text.strip())
    text = text if span is None else f"{UNIFORM}({span[1]}, {span[2]})"
    found = _DISTRIBUTION.fullmatch(text.strip())
    if found is None:
        other = _OTHER_CALL.fullmatch(text.strip())
        if other is not None:
            raise InputError(f"{other[1]!r} is not a distribution", EXAMPLE)
        return listed(name, parts_of(text))
    kind, ends = found[1], parts_of(found[2])
    if len(ends) != 2:
        raise InputError(f"{kind} has two numbers, got {len(ends)}", EXAMPLE)
    (low, unit), (high, other_unit) = map(_number, ends)
    if unit != other_unit:
        raise InputError(f"{unit or 'no unit'} and {other_unit or 'no unit'} are different units")
    if kind == NORMAL and not high > 0.0:
        raise InputError(f"the deviation {high:g} is not above 0")
    if kind != NORMAL and not low < high:
        raise InputError(f"{low:g} is not below {high:g}")
    if kind == LOGUNIFORM and not low > 0.0:
        raise InputError(f"the lower end {low:g} of loguniform is not above 0")
    return Factor(name, kind, (), low, high, unit)


def listed(name: str, values: Sequence[str]) -> Factor:
    """Return a factor with a list of values.

    Raises:
        InputError: there are none, or one is there twice.
    """
    twice = next((value for value in values if values.count(value) > 1), None)
    if twice is not None:
        raise InputError(f"the value {twice} is listed twice")
    if not values:
        raise InputError("it has no values", EXAMPLE)
    return Factor(name, values=tuple(values))


def parts_of(text: str) -> list[str]:
    """Split a text at its commas; those in brackets, as of a pose, do not count."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "[{(") - (character in "]})")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return [part.strip() for part in parts if part.strip()]


def _rounded(number: float, digits: int) -> float:
    return float(f"{number:.{digits}g}")


def _number(text: str) -> tuple[float, str]:
    """Return a number and its unit.

    Raises:
        InputError: the text is not a number.
    """
    found = _NUMBER.fullmatch(text)
    if found is None:
        raise InputError(f"{text!r} is not a number", EXAMPLE)
    return float(found[1]), found[2] or ""
