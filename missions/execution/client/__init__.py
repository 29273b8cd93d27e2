"""Command of live runs from other processes: from code (`connect`) and by `treepilot tell`."""

from __future__ import annotations

from missions.execution.client.asynchronous import AsyncConnection
from missions.execution.client.connection import Connection
from missions.execution.client.conversation import ANSWER_TIMEOUT
from stack.telemetry.rendezvous import find_run

__all__ = ["AsyncConnection", "Connection", "connect", "connect_async"]


def connect(run: str = "", *, timeout: float = ANSWER_TIMEOUT) -> Connection:
    """Connect to a live run; use it in a `with` statement.

    Args:
        run: folder, name or first digits of the identity of a run; empty: the only live run.
        timeout: wall seconds that the engine may take to answer.

    Raises:
        TelemetryError: no run matches or several do, or the engine does not answer, has ended or
            is of another version. Every method raises it for the last three.
    """
    return Connection(find_run(run), timeout)


def connect_async(run: str = "", *, timeout: float = ANSWER_TIMEOUT) -> AsyncConnection:
    """Connect to a live run from a coroutine; use it in an `async with` statement.

    Args:
        run: as for `connect`.
        timeout: as for `connect`.

    Raises:
        TelemetryError: as for `connect`.
    """
    return AsyncConnection(find_run(run), timeout)
