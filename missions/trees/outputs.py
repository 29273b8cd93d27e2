"""Outputs of a leaf: what it writes reaches the blackboard unless it fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees.common import Status

Write = Callable[[Any], None]


class Outputs:
    """Holds back what a leaf writes until its tick has ended.

    After a tick in which it runs or succeeds the values are written to their targets. A leaf that
    fails or is halted writes nothing in that tick. After a failure the targets without an initial
    value are unset, so that nothing reads the result of an earlier run.
    """

    def __init__(self) -> None:
        self._pending: list[tuple[Write, Any]] = []
        self._optional: list[Write] = []

    def __bool__(self) -> bool:
        return True

    def target(self, write: Write, *, optional: bool) -> Write:
        """Return a writer for an output; `optional` if its key has no initial value."""
        if optional:
            self._optional.append(write)
        return lambda value: self._pending.append((write, value))

    def drop(self) -> None:
        """Forget what has been written since the last tick."""
        self._pending.clear()

    def settle(self, status: Status) -> None:
        """Write or drop the values of a tick that ended with a status."""
        if status is Status.FAILURE:
            self.drop()
            for write in self._optional:
                write(None)
            return
        pending, self._pending = self._pending, []
        for write, value in pending:
            write(value)
