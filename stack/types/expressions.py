"""What mission expressions become in behaviours: callables and assignments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol


class Expression(Protocol):
    """A checked expression of a mission file, ready to be evaluated on the robot's own values."""

    source: str

    def __call__(self) -> Any:
        """The value now; a bool for conditions."""
        ...

    def explain(self) -> str:
        """The expression with the values its names have now, e.g. `battery.charge (0.18) > 0.3`."""
        ...


@dataclass(frozen=True, slots=True)
class Assignments:
    """What `set` writes: blackboard keys, each with the expression for its new value."""

    writes: tuple[tuple[str, Expression, Callable[[Any], None]], ...] = field(default=())
