"""`treepilot runs`: lists, deletes and opens the folders of runs."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.arguments import counted
from stack.errors import InputError

if TYPE_CHECKING:
    from missions.inspection.run_folders import RunFolderEntry

HELP = """List, delete and open the folders of runs.

Without a command, list the runs below ./runs, newest first: name, mission, status, start, simulated
time and size. The status `live` means that the run is not over, `incomplete` that it ended without
a report. A folder is a run folder if it contains events.jsonl and mission.yaml; no other folder and
no live run is ever deleted, and symbolic links are not followed.

A run folder holds all that the run was made of: `runs repeat` runs it again and says whether the
result is the same, `runs pack` makes one file of it for another machine, and `runs open` unpacks
that.

\b
    treepilot runs
    treepilot runs delete 02_office_patrol-20261122-164218
    treepilot runs keep 10
    treepilot runs open 02_office_patrol-20261122-164218
    treepilot runs pack 02_office_patrol-20261122-164218 -o run.zip
    treepilot runs open run.zip
    treepilot runs repeat 02_office_patrol-20261122-164218
"""

runs_app = typer.Typer(help=HELP, invoke_without_command=True)

Yes = Annotated[bool, typer.Option("--yes", "-y", help="do not ask for confirmation")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="name of a run, as listed")]


@runs_app.callback()
def _runs(
    context: typer.Context,
    folder: Annotated[
        Path, typer.Option("--folder", metavar="FOLDER", help="folder that contains the runs")
    ] = Path("runs"),
    json: Annotated[bool, typer.Option("--json", help="list as JSON")] = False,
) -> None:
    context.obj = folder
    if context.invoked_subcommand is not None:
        return
    from missions.inspection.run_folders import find_runs, table

    runs = find_runs(folder)
    if json:
        from json import dumps

        typer.echo(dumps([run.plain() for run in runs], indent=2, ensure_ascii=False))
    elif runs:
        typer.echo("\n".join(table(runs)))
    else:
        typer.echo(f"no runs in {folder}")


@runs_app.command()
def delete(
    context: typer.Context,
    names: Annotated[list[str], typer.Argument(metavar="NAME...", help="names of runs, as listed")],
    yes: Yes = False,
) -> None:
    """Delete runs. If one of the names is wrong or its run is live, nothing is deleted."""
    from missions.inspection.run_folders import chosen_runs, find_runs

    _delete(context.obj, chosen_runs(find_runs(context.obj), names), yes)


@runs_app.command()
def keep(
    context: typer.Context,
    count: Annotated[int, typer.Argument(min=0, metavar="N", help="number of runs to keep")],
    yes: Yes = False,
) -> None:
    """Delete all runs but the newest N. Live runs are kept in any case."""
    from missions.inspection.run_folders import find_runs, older_than_newest

    _delete(context.obj, older_than_newest(find_runs(context.obj), count), yes)


@runs_app.command("pack")
def pack_(
    context: typer.Context,
    name: Name,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="default: NAME.zip")
    ] = None,
) -> None:
    """Write a run with all that it was made of into one zip file, for another machine."""
    from missions.inspection.exchange.packing import pack
    from missions.inspection.run_folders import find_run, size_text

    folder = find_run(name, context.obj)
    target = out or Path(f"{folder.name}.zip")
    size = pack(folder, target)
    typer.echo(
        f"{target}: {size_text(size)}; on the other machine: treepilot runs open {target.name}"
    )


@runs_app.command("repeat")
def repeat(context: typer.Context, name: Name) -> None:
    """Run a run again from the copies in its folder; say whether the result is the same.

    It executes the plugins that the run brings: repeat only runs of people you trust. All other
    commands that take a run execute nothing of it.

    Exit codes: 0 the event log is the same, bit for bit; 1 it is not: the first difference is
    printed, and which versions or files are others.
    """
    from missions.execution.repeat import repeat_run
    from missions.inspection.run_folders import find_run

    done = repeat_run(find_run(name, context.obj))
    typer.echo(done.report.summary())
    if done.is_same:
        typer.echo("the same run: the event log is equal, bit for bit")
        return
    typer.echo(f"not the same run; {done.difference}")
    for reason in done.reasons or ("versions and files are the same; was it commanded?",):
        typer.echo(f"  {reason}")
    raise typer.Exit(1)


@runs_app.command("open")
def open_(
    context: typer.Context,
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE.zip", help="name of a run, or a packed run")
    ],
    web: Annotated[
        bool, typer.Option("--web", help="show it in a browser, also over SSH: port 9090")
    ] = False,
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="make a file for Foxglove; tell how to open it")
    ] = False,
) -> None:
    """Show a run in rerun's viewer; or unpack a packed run.

    The recording is drawn from the run's snapshots and kept as mission.rrd. A live run is followed
    until it ends. Over SSH there is no display: the command then prints what to enter on your own
    computer.
    """
    if name.endswith(".zip"):
        _unpack(Path(name), context.obj)
        return
    from missions.inspection.run_folders import find_runs
    from stack.parameters import suggestion

    known = {run.name: run for run in find_runs(context.obj)}
    if name not in known:
        raise InputError(f"no run {name!r}; {suggestion(name, known)}")
    if foxglove:
        _open_foxglove(context.obj / name)
        return
    from missions.inspection.exchange.rerun_viewer import show

    show(context.obj / name, web=web)


def _open_foxglove(folder: Path) -> None:
    """Export a run beside its records, and say how to open it."""
    import os

    from missions.inspection.exchange.exporting import FILE, export_mcap
    from missions.inspection.exchange.viewing import copying, has_display

    file = folder / FILE
    export_mcap(folder, file)
    typer.echo(f"{shlex.quote(str(file))}: in Foxglove, Open local file")
    if not has_display(os.environ, sys.platform):
        typer.echo(f"copy it to your computer: {copying(file, os.environ)}")


def _unpack(packed: Path, parent: Path) -> None:
    from missions.inspection.exchange.packing import unpack

    folder = unpack(packed, parent)
    typer.echo(f"{folder}: see it again with")
    for words in (
        ("replay", str(folder)), ("trace", str(folder)), ("runs", "repeat", str(folder)),
        ("runs", "--folder", str(parent), "open", folder.name),
    ):  # fmt: skip
        typer.echo(f"  {shlex.join(['treepilot', *words])}")


def _delete(parent: Path, runs: "list[RunFolderEntry]", yes: bool) -> None:
    """Delete runs after a confirmation.

    Raises:
        InputError: there is nobody to ask, or a run cannot be deleted.
    """
    from missions.inspection.run_folders import delete_run, size_text

    if not runs:
        typer.echo("nothing to delete")
        return
    size = size_text(sum(run.size for run in runs))
    what = f"{counted(len(runs), 'run')}, {size}"
    if not yes:
        if not (sys.stdin.isatty() and sys.stdout.isatty()):
            raise InputError("deleting needs --yes when there is no terminal to ask on")
        for run in runs:
            typer.echo(f"  {run.name}  {run.status}  {size_text(run.size)}")
        if not typer.confirm(f"delete {what}?"):
            typer.echo("nothing was deleted")
            return
    for run in runs:
        delete_run(parent, run.name)
    typer.echo(f"deleted {what}")
