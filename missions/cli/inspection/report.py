"""`treepilot report`: an HTML page about a run."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from stack.errors import InputError

MOST_RUNS = 4


def report(
    runs: Annotated[
        list[str],
        typer.Argument(metavar="RUN...", help="run folders, names of runs in ./runs, or `newest`"),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="default: report.html in the run folder"),
    ] = None,
) -> None:
    """Write an HTML page about a run: what happened, where and why.

    One file without scripts that needs no network: the outcome, the map with the driven way, the
    timeline of the tree, what failed with the lines of the mission, plots, and the settings that
    are not the defaults. Of several runs, at most 4, side by side, with the first difference.
    """
    from missions.inspection.page.page import page_of
    from missions.inspection.page.story import read_story
    from missions.inspection.run_folders import find_run

    if len(runs) > MOST_RUNS:
        raise InputError(f"{len(runs)} runs; at most {MOST_RUNS} fit side by side")
    folders = [find_run(run, Path("runs")) for run in runs]
    page = page_of([read_story(folder) for folder in folders])
    file = out or folders[0] / "report.html"
    file.write_text(page, "utf-8")
    typer.echo(f"{shlex.quote(str(file))}")
