"""`treepilot falsify`: search settings and faults that break a mission."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.arguments import OtherRobot, Parameters, Settings, assignments
from stack.errors import InputError

if TYPE_CHECKING:
    from missions.falsify.falsifier import Outcome
    from missions.sweeps.factors import Factor
    from missions.sweeps.sweep import Sweep

EPILOG = """
\b
  treepilot falsify my.yaml --faults lidar_dropout,push --runs 200 --jobs 2
  treepilot falsify my.yaml --vary person.anna.start="uniform(0, 0.99)" --margin 'clearance > 0.1'
  treepilot falsify my.yaml --vary start.x="uniform(1, 3)" --vary start.y="uniform(1, 2)" \\
      --vary controller.cruise_speed="uniform(0.2, 0.8)" --margin time --margin error

Factors are those of `treepilot sweep`, and numbers of the start (start.x, start.y, start.heading),
of people (person.NAME.start) and of faults (fault.NAME.at). --faults adds the times and numbers of
each kind over their whole ranges; --vary narrows them. A margin is a figure of a run (clearance,
time, error), or a condition on one. What is found is shrunk: faults and settings that do not matter
are left out, the others brought closer to their defaults. Run the command again to continue.
"""


def falsify(  # noqa: PLR0913 - each is an option of the command
    mission: Annotated[str, typer.Argument(metavar="MISSION", help="mission, or its name")],
    runs: Annotated[int, typer.Option(min=4, help="runs of the search")] = 200,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUES", help="factor, as of `treepilot sweep`; repeatable"),
    ] = None,
    faults: Annotated[
        str, typer.Option(metavar="KINDS", help="kinds of faults, separated by commas")
    ] = "",
    margin: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FIGURE",
            help="clearance, time, error, or e.g. 'clearance > 0.1' [default: clearance > 0.02]",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="of all runs, and of the search")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="processes")] = 1,
    out: Annotated[
        Path | None, typer.Option(help="folder of the results [default: falsify/MISSION]")
    ] = None,
    time_limit: Annotated[
        str, typer.Option(metavar="DURATION", help="simulated time of a run")
    ] = "5 min",
    robot: OtherRobot = None,
    set_: Settings = None,
    parameter: Parameters = None,
) -> None:
    """Search settings and faults that break a mission.

    The simplest ones are written as a mission.

    Every run counts as broken that collides, fails, or misses a margin. Exit codes: 0 nothing was
    found, 1 the mission breaks.
    """
    from missions.cli.sweep_runs import interruptible, tell
    from missions.cli.tune import duration
    from missions.falsify.falsifier import Falsifier, Trial, baseline, describe
    from missions.falsify.margin import margin_of, read_requirement
    from missions.falsify.ranges import fault_factors
    from missions.sweeps.checking import checked
    from missions.sweeps.design import RANDOM
    from missions.sweeps.runner import ExecutionSettings
    from missions.sweeps.sweep import NONE, Sweep
    from missions.sweeps.table import SweepFolder
    from stack.sim.faults.registry import fault_kind

    limit = duration(time_limit, "--time-limit")
    requirements = [read_requirement(text, limit) for text in margin or ["clearance"]]
    kinds = list(dict.fromkeys(name.strip() for name in faults.split(",") if name.strip()))
    sweep = Sweep(
        mission, runs, RANDOM, (), seed, assignments(set_ or []),
        assignments(parameter or [], "--parameter"), robot, faults="+".join(kinds) or None,
        time_limit=limit, keep=NONE,
    )  # fmt: skip
    if not (kinds or vary):
        raise InputError("there is nothing to search", "give --vary or --faults")
    given = tuple(_given(vary or []))
    for kind in kinds:
        fault_kind(kind)
    checked(replace(sweep, factors=given), _refused)
    folder = SweepFolder(out or Path("falsify") / Path(mission).stem)
    first = Trial(row := baseline(sweep, folder), margin_of(row, requirements))
    tell(f"without faults and settings: margin {describe(first)}")
    if first.margin < 0.0:
        tell("the mission breaks as it is: there is nothing to search")
        raise typer.Exit(1)
    factors = {item.name: item for item in fault_factors(kinds, row.seconds or limit)}
    factors |= {item.name: item for item in given}
    ready = checked(replace(sweep, factors=tuple(factors.values())), _refused)
    with interruptible(folder.path) as check:
        execution = ExecutionSettings(jobs, check=check)
        outcome = Falsifier(ready, requirements, folder, execution, tell).run()
        _end(outcome, ready.sweep, folder.path)


def _refused(factor: "Factor", error: InputError) -> InputError:
    return InputError(f"{factor.name}: {error}")


def _given(vary: list[str]) -> "list[Factor]":
    from missions.sweeps.factors import read_factor

    found = []
    for name, text in assignments(vary, "--vary", "controller.cruise_speed=0.4,0.8").items():
        try:
            found.append(read_factor(name, text))
        except InputError as error:
            raise InputError(f"--vary {name}={text}: {error}") from None
    return found


def _end(outcome: "Outcome", sweep: "Sweep", folder: Path) -> None:
    from missions.cli.sweep_runs import tell
    from missions.falsify.falsifier import describe, figures_of
    from missions.falsify.reproduction import write_reproduction

    typer.echo(f"least margin of {outcome.runs} runs: {describe(outcome.worst)}")
    if outcome.shrunk is None:
        typer.echo("no run breaks the mission")
        return
    heading = f"Breaks with seed {sweep.seed}: margin {figures_of(outcome.shrunk)}"
    file, report = write_reproduction(sweep, outcome.shrunk.settings, folder, heading)
    typer.echo(f"shrunk: {describe(outcome.shrunk)}")
    typer.echo(f"{report.summary()}")
    row = outcome.shrunk.row
    if report.status != row.outcome and row.outcome != "time limit":
        tell(f"{file} ended with {report.status}, the search with {row.outcome}")
    typer.echo(f"treepilot run {file} --seed {sweep.seed}")
    raise typer.Exit(1)
