"""`treepilot tell`: sends one order to a running mission and waits for the answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import monotonic, sleep  # noqa: TID251 - waiting for another process
from typing import Any, TypeVar
from uuid import uuid4

from stack.errors import InputError, TelemetryError
from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import Ack, Command, Snapshot, TreeRow
from stack.telemetry.rendezvous import find_run

PATIENCE = 10.0
"""Wall seconds to wait for an engine's answer: an optimiser's compilation takes some."""

GLYPHS = {"running": "▶", "success": "✔", "failure": "✘", "idle": "·"}

T = TypeVar("T")


def tell(run: str, kind: str, arguments: dict[str, Any]) -> str:
    """Give an order to a run; what was understood.

    Args:
        run: its name or folder; the newest when empty.
        kind: of a Command.
        arguments: of the Command.

    Raises:
        InputError: the engine refused; the message says why.
        TelemetryError: no such run, or no answer.
    """
    client = TelemetryClient(find_run(run).address)
    try:
        command = Command(uuid4().hex, kind, arguments)
        client.send(command)

        def answered() -> Ack | None:
            client.poll()
            return next((ack for ack in client.acks() if ack.id == command.id), None)

        ack = _until(client, answered)
    finally:
        client.close()
    if not ack.done:
        raise InputError(f"{kind}: {ack.reason}")
    return ack.reason or "done"


def status_lines(run: str) -> list[str]:
    """How a run goes: a line about the mission, then a line a node with its number."""
    client = TelemetryClient(find_run(run).address)
    try:
        snapshot = _until(client, client.poll)
    finally:
        client.close()
    reason = f": {snapshot.reason}" if snapshot.reason else ""
    return [f"{snapshot.state}{reason}, {snapshot.time:.1f} s", *_node_lines(snapshot)]


def _node_lines(snapshot: Snapshot) -> Iterator[str]:
    debugging, depth = snapshot.debugging, {-1: -1}
    for row in snapshot.tree:
        depth[row.id] = depth[row.parent] + 1
        marks = _marks(row, snapshot)
        dot = "●" if row.id in debugging.breakpoints else " "
        words = f"  ({', '.join(marks)})" if marks else ""
        yield f"{row.id:4d} {dot} {'  ' * depth[row.id]}{GLYPHS[row.status]} {row.name}{words}"


def _marks(row: TreeRow, snapshot: Snapshot) -> list[str]:
    debugging = snapshot.debugging
    marks = [row.message] if row.message and row.status != "idle" else []
    marks += ["starts with the next tick"] if row.id in debugging.held else []
    forced = debugging.forced.get(str(row.id))
    return marks + ([f"forced: {forced}"] if forced else [])


def _until(client: TelemetryClient, look: Callable[[], T | None]) -> T:
    deadline = monotonic() + PATIENCE
    while monotonic() < deadline:
        found = look()
        if found is not None:
            return found
        if client.is_over:
            raise TelemetryError("the run ended before it answered")
        sleep(0.01)
    raise TelemetryError(f"no answer within {PATIENCE:g} s")
