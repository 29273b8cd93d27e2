"""`treepilot trace`: the history of a finished run, node by node."""

from math import inf
from pathlib import Path
from typing import Annotated

import typer

from stack.errors import InputError


def trace(  # noqa: PLR0913 - options of a command
    run: Annotated[str, typer.Argument(help="run folder, name of a run in ./runs, or `newest`")],
    node: Annotated[
        str,
        typer.Option(help="show only this node and its children: name, kind, path or file:line"),
    ] = "",
    since: Annotated[float, typer.Option(help="first time shown, seconds")] = 0.0,
    until: Annotated[
        float, typer.Option(help="last time shown, seconds", show_default="the end")
    ] = inf,
    at: Annotated[
        str,
        typer.Option(metavar="TIME", help="print the tree as it was then: 83.5, 1:23 or 1:02:03"),
    ] = "",
    summary: Annotated[
        bool, typer.Option("--summary", help="print one line per node: times and states")
    ] = False,
) -> None:
    """Show the history of a finished run, node by node.

    For a node that never started, the reason is printed.
    """
    from missions.execution.supervision.replaying import time_of
    from missions.inspection import trace as tracing
    from missions.inspection.run_folders import find_run

    if at and (node or summary or since or until < inf):
        raise InputError("--at shows the whole tree; leave out the other options")
    told = tracing.read_trace(find_run(run, Path("runs")))
    if at:
        lines = tracing.tree_at(told, time_of(at))
    elif summary:
        lines = tracing.summary(told, node)
    else:
        lines = tracing.story(told, node, since, until)
    for line in lines:
        typer.echo(line)
