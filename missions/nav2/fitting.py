"""Values of Nav2 that treepilot does not accept: the nearest value that it accepts, or the default.

Nav2 declares no ranges. A value that it accepts is never an error here.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

from stack.components import DEFAULTS, component
from stack.costmap.parameters import CostmapParameters
from stack.errors import ParameterError
from stack.navigation.parameters import NavigationParameters
from stack.parameters import Declaration, declarations
from stack.safety.parameters import SafetyParameters

_SETTINGS: Mapping[str, type] = {
    "costmap": CostmapParameters, "navigator": NavigationParameters, "safety": SafetyParameters,
}  # fmt: skip


def declared_for(kind: str, use: str | None) -> Mapping[str, Declaration]:
    """Return the parameters of the settings, or of the component `use` (None: the default)."""
    if kind in _SETTINGS:
        return declarations(_SETTINGS[kind])
    return declarations(component(kind, use or DEFAULTS[kind]).Parameters)  # type: ignore[attr-defined]


def fitted(declared: Declaration, value: Any) -> tuple[Any, str]:
    """Return the nearest accepted value and, if it differs, a sentence that says so.

    The value is None, for the default, where none is nearest: beyond a limit that is not accepted
    itself (often 0, "off" in Nav2), and at an infinite distance.

    Raises:
        ParameterError: it has the wrong type, for Nav2 too.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return declared.read(value), ""
    if declared.type is int and isfinite(value) and value == int(value):
        value = int(value)
    try:
        return declared.read(value), ""
    except ParameterError:
        nearest = _nearest(declared, value)
        if nearest == value:  # the range is not what is wrong
            raise
    unit = f" {declared.unit}" if declared.unit else ""
    outside = f"{value:g}{unit} is outside the range of {declared.name} ({declared.range_text()})"
    if nearest is None:
        return None, f"{outside}; the default is used"
    return nearest, f"{outside}; {nearest:g}{unit} is used"


def _nearest(declared: Declaration, value: float) -> float | None:
    low, high = declared.at_least, declared.at_most
    nearest = value
    if low is not None and value < low:
        nearest = low
    elif high is not None and value > high:
        nearest = high
    elif (declared.above is not None and value <= declared.above) or not isfinite(value):
        return None
    return int(nearest) if declared.type is int and nearest != value else nearest


def lowered(
    values: Mapping[str, Any], declared: Mapping[str, Declaration]
) -> dict[str, tuple[Any, str]]:
    """Return the parameters that are above one they must not exceed: the lower value, a sentence.

    Args:
        values: imported ones; the others have their defaults.
        declared: the parameters of the component.
    """
    found = {}
    for low in declared.values():
        high = declared.get(low.not_above)
        if high is None or not {low.name, high.name} & set(values):
            continue
        least, most = values.get(low.name, low.default), values.get(high.name, high.default)
        if least is not None and most and least > most:
            sentence = f"{least:g} is above {high.name} {most:g}; {most:g} is used"
            found[low.name] = most, sentence
    return found
