"""Numbers with units, as files write them: `30 cm`, `90 deg`, `5 min`."""

from __future__ import annotations

import re
import types
from collections.abc import Mapping
from math import isfinite, pi
from typing import Any

from stack.errors import Hint, ParameterError
from stack.parameters.names import write

EXACT = 2**53
"""Every whole number up to this one has an exact floating-point value."""
_EXACT_HINT = f"numbers other than whole numbers are exact up to {EXACT}"

_UNITS: dict[str, tuple[str, float]] = {
    "m": ("m", 1.0), "cm": ("m", 0.01), "mm": ("m", 0.001), "km": ("m", 1000.0),
    "s": ("s", 1.0), "ms": ("s", 0.001), "min": ("s", 60.0), "h": ("s", 3600.0),
    "rad": ("rad", 1.0), "deg": ("rad", pi / 180.0), "turn": ("rad", 2.0 * pi),
    "m/s": ("m/s", 1.0), "cm/s": ("m/s", 0.01), "km/h": ("m/s", 1.0 / 3.6),
    "rad/s": ("rad/s", 1.0), "deg/s": ("rad/s", pi / 180.0),
    "m/s²": ("m/s²", 1.0), "m/s2": ("m/s²", 1.0), "m/s^2": ("m/s²", 1.0),
    "rad/s²": ("rad/s²", 1.0), "rad/s2": ("rad/s²", 1.0), "deg/s²": ("rad/s²", pi / 180.0),
    "m/s³": ("m/s³", 1.0), "rad/s³": ("rad/s³", 1.0),
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
    **dict.fromkeys(("percent", "pct"), "%"),
}
"""Other spellings of units, in lower case -> the unit."""
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*?)?\s*")
_DIGITS = re.compile(r"[-+]?\d+(?:\.0*)?")
_EXAMPLES = {
    "m": "50 cm", "s": "5 s", "rad": "90 deg", "m/s": "0.3 m/s", "rad/s": "45 deg/s",
    "m/s²": "0.5 m/s²", "Hz": "10 Hz",
}  # fmt: skip


def read_number(raw: Any, unit: str) -> float:
    """Convert a number of a file, or a text with a unit, to SI.

    Raises:
        ParameterError: it is neither, or not finite.
    """
    if isinstance(raw, float):
        if not isfinite(raw):
            raise ParameterError("", f"{raw!r} is not a finite number")
        return raw
    if isinstance(raw, int) and not isinstance(raw, bool):
        return _exact(str(raw))
    if isinstance(raw, str):
        return read_quantity(raw, unit)
    raise ParameterError("", f"expected {_number_words(unit)}, got {shown(raw)}")


def read_quantity(text: str, unit: str) -> float:
    """Convert a number with optional unit to SI: ("30 cm", "m") gives 0.3.

    Raises:
        ParameterError: the text is not a number, its unit is unknown or of another dimension.
    """
    match = _QUANTITY.fullmatch(text)
    if not match:
        example = _EXAMPLES.get(unit)
        hint = Hint(f"write a number with a unit: {example}" if example else "write digits: 5")
        raise ParameterError("", f"expected {_number_words(unit)}, got {text!r}", hint)
    number, written = _exact(match[1]), match[2]
    if written is None:
        value = number
    else:
        if written not in _UNITS:
            hint = _units_hint(unit, match[1])
            comma = re.fullmatch(r",(\d+)\s*(.*)", written)
            if comma:
                point = f"{match[1]}.{comma[1]} {comma[2]}".rstrip()
                hint = Hint(f"write a decimal point: {point}", point)
            clock = re.fullmatch(r":(\d\d)", written)
            if clock and unit == "s":
                hint = write(f"{int(60 * number + int(clock[1]))} s")
            elif _ELSEWHERE.get(written.lower()):
                hint = write(f"{match[1]} {_ELSEWHERE[written.lower()]}")
            raise ParameterError("", f"unknown unit {written!r} in {text!r}", hint)
        dimension, factor = _UNITS[written]
        if dimension != unit:
            sentence = f"{text!r} is in {written}, expected {_number_words(unit)}"
            raise ParameterError("", sentence, _units_hint(unit, match[1], written))
        value = number * factor
    if not isfinite(value):
        raise ParameterError("", f"{text!r} is not a finite number")
    return value


def _exact(numeral: str) -> float:
    """Convert a numeral; a whole number that would become another number is refused.

    Raises:
        ParameterError: the number exceeds 2^53 and has no exact floating-point value.
    """
    number = float(numeral)
    whole = numeral.partition(".")[0]
    if abs(number) >= EXACT and _DIGITS.fullmatch(numeral):
        if not isfinite(number) or len(whole) > 400 or int(number) != int(whole):
            raise ParameterError("", f"{shown(numeral)} cannot be stored exactly", _EXACT_HINT)
    return number


def quantity_unit(text: str) -> str | None:
    """The unit of a number with a unit, such as "30 cm"; None for any other text."""
    match = _QUANTITY.fullmatch(text)
    return match[2] if match and match[2] in _UNITS else None


def units() -> Mapping[str, tuple[str, float]]:
    """The units allowed in files: unit -> (SI unit of its dimension, factor)."""
    return types.MappingProxyType(_UNITS)


def _number_words(unit: str) -> str:
    return {"s": "a duration", "": "a number", "rad": "an angle", "m": "a length"}.get(
        unit, f"a number in {unit}"
    )


def unit_elsewhere(word: str) -> str:
    """Return the unit that another spelling means; "" if none."""
    return _ELSEWHERE.get(word.lower(), "")


def _units_hint(unit: str, number: str, written: str = "") -> Hint:
    """Return the hint for a number with a wrong unit: the units, with the usual one at first."""
    units = [name for name, (dimension, _) in _UNITS.items() if dimension == unit]
    if not units:
        return Hint("no unit is allowed here", number)
    usual = "min" if (unit, written) == ("s", "m") else _EXAMPLES.get(unit, units[0]).split()[-1]
    fixed = f"{number} {usual}"
    return Hint(f"allowed units: {', '.join(units)}; for example {fixed}", fixed)


def shown(raw: Any) -> str:
    """A raw value as messages quote it, at most 60 characters."""
    if raw is None:
        return "nothing"
    text = {True: "true", False: "false"}[raw] if isinstance(raw, bool) else repr(raw)
    return text if len(text) <= 60 else text[:57] + "..."
