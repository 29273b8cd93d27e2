"""Units of products and quotients: a unit is a product of powers of base units.

The unit of a number is a text: "" for a plain number, whose unit is not stated; "1" for a number
known to have no unit, such as a share; otherwise SI: "m", "m/s", "m·s". In sums and comparisons a
plain number has the unit of the other operand. In products it is a factor without a unit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache

PLAIN, NO_UNIT = "", "1"

Powers = tuple[tuple[str, int], ...]
"""(base unit, exponent) in the order of `_BASES`, without exponents of 0."""

_BASES = ("kg", "m", "rad", "px", "V", "Wh", "s")
"""Wh is a base unit: in SI it is 3600 J, and values are stored in Wh."""
_NAMED = {"Hz": "1/s", "N": "kg·m/s²", "W": "kg·m²/s³"}
_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_DIGITS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")
_FACTOR = re.compile(r"([A-Za-z]+)([⁰¹²³⁴⁵⁶⁷⁸⁹]*)")


def product(left: str, right: str) -> str:
    """Return the unit of `left * right`."""
    return _combined(left, right, 1)


def quotient(left: str, right: str) -> str:
    """Return the unit of `left / right`."""
    return _combined(left, right, -1)


@lru_cache(maxsize=1024)
def _combined(left: str, right: str, sign: int) -> str:
    if PLAIN in (left, right) and left == right:
        return PLAIN
    powers = dict(_powers(left))
    for base, exponent in _powers(right):
        powers[base] = powers.get(base, 0) + sign * exponent
    return _name(_ordered(powers))


@lru_cache(maxsize=1024)
def _powers(unit: str) -> Powers:
    """Return the powers in the name of a unit; the inverse of `_name`."""
    powers: dict[str, int] = {}
    above, _, below = _NAMED.get(unit, unit).partition("/")
    for part, sign in ((above, 1), (below.strip("()"), -1)):
        for word in part.split("·"):
            found = _FACTOR.fullmatch(word)
            if found and found[1] in _BASES:
                exponent = int(found[2].translate(_DIGITS) or 1)
                powers[found[1]] = powers.get(found[1], 0) + sign * exponent
    return _ordered(powers)


def _ordered(powers: Mapping[str, int]) -> Powers:
    return tuple((base, powers[base]) for base in _BASES if powers.get(base))


def _name(powers: Powers) -> str:
    """Return the name of a unit: "m/s", "m·s", "m²"."""
    if not powers:
        return NO_UNIT
    above = "·".join(_power(base, exponent) for base, exponent in powers if exponent > 0)
    below = [_power(base, -exponent) for base, exponent in powers if exponent < 0]
    divisor = "·".join(below) if len(below) < 2 else f"({'·'.join(below)})"
    name = f"{above or '1'}/{divisor}" if below else above
    return next((short for short, long in _NAMED.items() if long == name), name)


def _power(base: str, exponent: int) -> str:
    return base if exponent == 1 else base + str(exponent).translate(_SUPERSCRIPTS)
