"""`treepilot tell`: send one command to a running mission and wait for the answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from time import monotonic, sleep  # noqa: TID251 - waiting for another process
from typing import Any, TypeVar
from uuid import uuid4

from stack.errors import InputError, TelemetryError
from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import Ack, Command, Snapshot, TreeRow
from stack.telemetry.rendezvous import find_run
from stack.telemetry.tree_text import STATUS_GLYPH, depths

ANSWER_TIMEOUT = 10.0
"""Wall seconds to wait for an engine's answer: compiling an optimiser takes several."""

T = TypeVar("T")


def tell(run: str, kind: str, arguments: dict[str, Any]) -> str:
    """Send a command to a run and return the engine's answer.

    Args:
        run: folder, name or first digits of the identity of the run; `only`: the only live run.
        kind: the kind of the `Command`.
        arguments: the arguments of the `Command`.

    Raises:
        InputError: the engine refused the command; the message gives the reason.
        TelemetryError: the run does not exist or does not answer.
    """
    with closing(TelemetryClient(find_run(run))) as client:
        command = Command(uuid4().hex, kind, arguments)
        client.send(command)

        def answered() -> Ack | None:
            client.poll()
            return next((ack for ack in client.acks() if ack.id == command.id), None)

        ack = _until(client, answered)
    if not ack.done:
        raise InputError(f"{kind}: {ack.reason}")
    return ack.reason or "done"


def status_lines(run: str) -> list[str]:
    """Return the state of a run: one line for the mission, then one per node with its number."""
    with closing(TelemetryClient(find_run(run))) as client:
        snapshot = _until(client, client.poll)
    reason = f": {snapshot.reason}" if snapshot.reason else ""
    return [f"{snapshot.state}{reason}, {snapshot.time:.1f} s", *_node_lines(snapshot)]


def _node_lines(snapshot: Snapshot) -> Iterator[str]:
    debugging, depth = snapshot.debugging, depths(snapshot.tree)
    for row in snapshot.tree:
        marks = _marks(row, snapshot)
        dot = "●" if row.id in debugging.breakpoints else " "
        words = f"  ({', '.join(marks)})" if marks else ""
        node = f"{'  ' * depth[row.id]}{STATUS_GLYPH[row.status]} {row.name}"
        yield f"{row.id:4d} {dot} {node}{words}"


def _marks(row: TreeRow, snapshot: Snapshot) -> list[str]:
    debugging = snapshot.debugging
    marks = [row.message] if row.message and row.status != "idle" else []
    marks += ["starts with the next tick"] if row.id in debugging.held else []
    forced = debugging.forced.get(str(row.id))
    return marks + ([f"forced: {forced}"] if forced else [])


def _until(client: TelemetryClient, poll: Callable[[], T | None]) -> T:
    deadline = monotonic() + ANSWER_TIMEOUT
    while monotonic() < deadline:
        found = poll()
        if found is not None:
            return found
        if client.is_over:
            raise TelemetryError("the run ended before it answered")
        sleep(0.01)
    raise TelemetryError(f"no answer within {ANSWER_TIMEOUT:g} s")
