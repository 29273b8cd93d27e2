"""Values of expressions at ports: computed when their node starts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from missions.language.expressions.scope import UNSET

Read = Callable[[], Any]


class Latch:
    """Reader of an expression at a port: computed when the node starts, then constant.

    A reader that no node takes is computed on each access.
    """

    __slots__ = ("_value", "compute")

    def __init__(self, compute: Read) -> None:
        self.compute, self._value = compute, UNSET

    def take(self) -> None:
        """Compute the value for the run that starts now."""
        self._value = self.compute()

    def __call__(self) -> Any:
        """Return the value of this run."""
        return self.compute() if self._value is UNSET else self._value
