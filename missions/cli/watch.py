"""`treepilot watch`: attaches the dashboard to a running mission."""

from typing import Annotated

import typer

from missions.cli.arguments import on_a_terminal
from stack.errors import InputError


def watch(
    run: Annotated[str, typer.Argument(help="name or folder of a run [default: the newest]")] = "",
) -> None:
    """Attach the dashboard to a running mission.

    Closing the dashboard does not stop the mission.
    """
    from missions.execution.supervision.watching import watch_run

    if not on_a_terminal():
        raise InputError("watch needs a terminal; without one, read events.jsonl in the run folder")
    raise typer.Exit(watch_run(run))
