"""`treepilot sweep --faults`: missions by faults."""

from math import isnan
from pathlib import Path
from typing import Annotated

import typer

from stack.errors import InputError

EPILOG = """
\b
  treepilot sweep --faults suite                                  all shipped missions that drive
  treepilot sweep --faults suite 01_drive_to_a_point 02_office_patrol
  treepilot sweep --faults wet_floor,lidar_dropout+push my.yaml --runs 5

Each mission runs without a fault and with each fault that fits its robot and world. `treepilot list
faults` lists kinds and shipped files. Each folder in OUT is a sweep that `sweep report` reads.
"""


def faults(  # noqa: PLR0913 - each is an option of the command
    missions: Annotated[
        list[str] | None,
        typer.Argument(metavar="MISSION...", help="missions [default: the shipped ones]"),
    ] = None,
    faults: Annotated[
        str, typer.Option(metavar="NAMES", help="suite, or faults separated by commas")
    ] = "suite",
    runs: Annotated[int, typer.Option(min=1, help="runs of each mission with each fault")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="of the first run")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="processes")] = 1,
    out: Annotated[Path, typer.Option(help="folder of the results")] = Path("sweeps/faults"),
    keep: Annotated[str, typer.Option(help="run folders: all, failures or none")] = "failures",
    time_limit: Annotated[
        str | None, typer.Option(metavar="DURATION", help="simulated time [default: 5 min]")
    ] = None,
    least: Annotated[
        float,
        typer.Option(
            "--fail-below", min=0.0, max=1.0,
            help="exit with 1 below this rate of success with faults, or with any collision",
        ),
    ] = 0.0,
) -> None:  # fmt: skip
    """Run missions with each of many faults: a table of what became of them."""
    from missions.cli.sweep_runs import interruptible, progress, tell
    from missions.cli.tune import duration
    from missions.sweeps.report.suite_page import suite_page
    from missions.sweeps.runner import ExecutionSettings
    from missions.sweeps.suite import (
        TIME_LIMIT_S,
        SuiteOptions,
        cells_of,
        fault_list,
        figures,
        plan_suite,
        run_suite,
        table_lines,
    )
    from missions.sweeps.sweep import KEEP

    if keep not in KEEP:
        raise InputError(f"--keep {keep}: expected one of {', '.join(KEEP)}")
    if isnan(least):
        raise InputError("--fail-below nan: expected a rate from 0 to 1")
    limit = TIME_LIMIT_S if time_limit is None else duration(time_limit, "--time-limit")
    suite = plan_suite(missions or [], fault_list(faults), SuiteOptions(runs, seed, limit, keep))
    for name, reason in suite.left_out.items():
        tell(f"left out: {name}: {reason}")
    shown = progress(suite.runs)
    with interruptible(out) as check:
        run_suite(suite, out, ExecutionSettings(jobs, check=check), shown.update)
    cells = cells_of(suite, out)
    for line in table_lines(suite, cells):
        typer.echo(line)
    page = out / "faults.html"
    page.write_text(suite_page(suite, cells), "utf-8")
    typer.echo(str(page))
    successes, count, collisions = figures(suite, cells)
    if least and (collisions or successes < least * count):
        tell(f"{successes} of {count} runs with a fault succeeded, {collisions} had a collision")
        raise typer.Exit(1)
