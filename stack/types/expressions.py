"""Mission expressions as behaviours receive them: callables and assignments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol


class Expression(Protocol):
    """A checked expression of a mission file, evaluated on the current values of the robot."""

    source: str

    def __call__(self) -> Any:
        """The current value; a bool for conditions."""

    def explain(self) -> str:
        """The expression with the current values of its names: `battery.charge (0.18) > 0.3`."""


@dataclass(frozen=True, slots=True)
class Assignments:
    """Assignments of `set`: blackboard keys, each with the expression for its new value.

    Attributes:
        writes: (key, expression, setter) of each assignment, in order.
    """

    writes: tuple[tuple[str, Expression, Callable[[Any], None]], ...] = field(default=())
