"""`treepilot watch`: attaches the dashboard to a running mission."""

from __future__ import annotations

from typing import Annotated

import typer

from missions.cli.arguments import on_a_terminal
from stack.errors import InputError


def watch(
    run: Annotated[str, typer.Argument(help="a run's name or folder [default: the newest]")] = "",
) -> None:
    """Attach the dashboard to a running mission; closing it stops nothing."""
    from missions.execution.supervisor import watch_run

    if not on_a_terminal():
        raise InputError("watch needs a terminal; without one read the run's events.jsonl")
    raise typer.Exit(watch_run(run))
