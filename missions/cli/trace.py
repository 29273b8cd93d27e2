"""`treepilot trace`: the history of a finished run, node by node."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def trace(
    run: Annotated[Path, typer.Argument(help="a run's folder")],
    node: Annotated[
        str, typer.Option(help="only this node and below: name, kind, path, file:line")
    ] = "",
    since: Annotated[float, typer.Option(help="robot time, s")] = 0.0,
    until: Annotated[float, typer.Option(help="robot time, s")] = 1e18,
    summary: Annotated[bool, typer.Option("--summary", help="a line a node instead")] = False,
) -> None:
    """Tell a finished run's story node by node, and why a node was never reached."""
    from missions.inspection import trace as tracing

    told = tracing.read_trace(run)
    lines = tracing.summary(told, node) if summary else tracing.story(told, node, since, until)
    for line in lines:
        typer.echo(line)
