"""`treepilot tell`: one command to a running mission, and its answer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from missions.execution.client.connection import Connection
from missions.execution.client.conversation import ANSWER_TIMEOUT
from stack.telemetry.records import Snapshot, TreeRow
from stack.telemetry.rendezvous import find_run
from stack.telemetry.tree_text import STATUS_GLYPH, depths


def tell(run: str, kind: str, arguments: dict[str, Any]) -> str:
    """Send a command to a run and return the engine's answer.

    Args:
        run: folder, name or first digits of the identity of the run; `only`: the only live run.
        kind: the kind of the `Command`.
        arguments: the arguments of the `Command`.

    Raises:
        CommandRefused: the engine refused the command; the message gives the reason.
        TelemetryError: the run does not exist or does not answer.
    """
    with Connection(find_run(run), ANSWER_TIMEOUT) as robot:
        return robot.command(kind, **arguments)


def status_lines(run: str) -> list[str]:
    """Return the state of a run: one line for the mission, then one per node with its number."""
    with Connection(find_run(run), ANSWER_TIMEOUT) as robot:
        snapshot = robot.snapshot
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
