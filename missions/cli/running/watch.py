"""`treepilot watch`: attaches the dashboard to a running mission, or lists the live runs."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import on_a_terminal
from stack.errors import InputError, TelemetryError

RUNS = Path("runs")


def watch(
    run: Annotated[
        str,
        typer.Argument(
            help="folder, name or first digits of the identity of a run [default: the only one]"
        ),
    ] = "",
    list_: Annotated[
        bool, typer.Option("--list", help="list your live runs with their states, open nothing")
    ] = False,
) -> None:
    """Attach the dashboard to a running mission.

    Closing the dashboard does not stop the mission. If several runs match, they are listed and none
    is opened.
    """
    if list_:
        _list(run)
        return
    from missions.execution.supervision.watching import watch_run
    from missions.inspection.run_folders import is_run_folder

    folder = next((one for one in (Path(run), RUNS / run) if run and is_run_folder(one)), None)
    if not on_a_terminal():
        raise InputError("watch needs a terminal; without one, read events.jsonl in the run folder")
    try:
        raise typer.Exit(watch_run(run))
    except TelemetryError as error:
        if folder is None:
            raise
        again = shlex.join(["treepilot", "replay", str(folder)])
        raise TelemetryError(f"{error}; to see the run again: {again}") from None


def _list(run: str) -> None:
    from stack.telemetry.rendezvous import live_runs, run_table

    if run:
        raise InputError("--list lists all live runs; leave out RUN")
    runs = live_runs()
    typer.echo(run_table(runs) if runs else "no mission is running")
