"""`treepilot tell`: one command to a running mission, and its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

from missions.execution.client import Connection, connect
from stack.documents.reader import value_of
from stack.errors import InputError
from stack.telemetry.records import Snapshot, TreeRow
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
    # Not in a `with` statement: an engine that shows nothing to more clients still stops.
    with closing(connect(run)) as robot:
        return robot.command(kind, **arguments)


def ask(run: str, act: Callable[[Connection], str | None]) -> str:
    """Do something with the robot of a run; return what `act` says of it.

    Raises:
        CommandRefused: the engine refused it.
        TelemetryError: the run does not exist or does not answer. Others: those of `act`.
    """
    with connect(run) as robot:
        return act(robot) or "done"


def go(robot: Connection, goal: str, *, wait: bool) -> str:
    """Let a robot drive to a place or `x,y,heading`; return what it does. Errors: `goto`."""
    robot.goto(goal, wait=wait)
    return "at the goal" if wait else f"the mission is paused; the robot drives to {goal}"


def change(robot: Connection, assignment: str) -> str:
    """Set a parameter of a run, written NAME=VALUE; return its new value.

    Raises:
        InputError: it is not NAME=VALUE.
        CommandRefused: there is no such parameter, or the value is wrong.
    """
    name, equals, value = (part.strip() for part in assignment.partition("="))
    if not (name and equals and value):
        raise InputError(f"{assignment}: expected NAME=VALUE: controller.cruise_speed=30cm/s")
    robot.set_parameter(name, value_of(value))
    return f"{name} is {robot.parameters[name]}"


def carry_out(robot: Connection, behaviour: str, ports: list[str], *, wait: bool) -> str:
    """Let a robot carry out a behaviour, with ports written NAME=VALUE. Errors: `run_behaviour`.

    Raises:
        InputError: a port is not NAME=VALUE.
    """
    for port in ports:
        if "=" not in port:
            raise InputError(f"{port}: expected NAME=VALUE, such as angle=90deg")
    given = {name.strip(): value for name, _, value in (port.partition("=") for port in ports)}
    robot.run_behaviour(behaviour, given, wait=wait)
    return "done" if wait else f"the mission is paused; the robot carries out {behaviour}"


def status_lines(run: str) -> list[str]:
    """Return the state of a run: one line for the mission, then one per node with its number."""
    with connect(run) as robot:
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
