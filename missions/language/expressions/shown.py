"""Values as texts for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from missions.language.expressions import arithmetic
from stack.types import Pose2D

MAX_SHOWN = 1000
"""Values of a list that are shown."""


def shown(value: Any, most: int = MAX_SHOWN) -> str:
    """Format a value for people; of a list at most this number of values, with inner lists."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    if isinstance(value, Pose2D):
        return f"[{value.x:.2f}, {value.y:.2f}, {value.heading * 57.29577951308232:.0f} deg]"
    if isinstance(value, list | tuple):
        return _shown_list(value, most)
    return str(value)


def _shown_list(items: Sequence[Any], most: int) -> str:
    parts: list[str] = []
    for item in items:
        if most <= 0:
            return f"[{', '.join(parts)}, …]"
        parts.append(shown(item, most))
        most -= arithmetic.size(item)
    return f"[{', '.join(parts)}]"
