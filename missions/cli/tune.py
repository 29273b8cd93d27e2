"""`treepilot tune`: scores settings of a mission's components. A part of missions.cli.app."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import assignments

INTERRUPTED = 130

EPILOG = """
\b
  treepilot tune 01_drive_to_a_point --try controller.cruise_speed=0.4..0.8 --jobs 2
  treepilot tune my.yaml --try controller.lookahead_time="0.8 s..1.6 s" \\
      --try planner.smoother=simple,constrained --refine 2 --weight clearance=2

What may be tried: `treepilot parameters MISSION` lists it, `treepilot describe pure_pursuit` its
ranges. The first sample is the mission as it is: the baseline. A run's cost is

\b
  sum(weight * value / baseline's value) / sum(weights) + weight of collisions * collisions

clearance the other way round: 1 is as good as now, 0.9 a tenth better; a failed run costs 10, more
than any that succeeds. Measures and their weights:

\b
  time 1           simulated time of the mission
  detour 0.5       way driven / shortest way by the goals reached
  clearance 0.5    least true distance to anything
  turning 0.5      mean change of the commanded angular velocity
  jerk 0.25        root mean square of the commanded jerk
  goal_error 0.5   true distance from the goals where it stops
  collisions 1     contacts of the moving robot

In the folder: runs.jsonl (every run), table.txt, scores.json, and best.yaml for `parameters:` of
the mission. Ctrl-C keeps what has been run; the same command goes on from there, and more samples,
seeds or other ranges add to it. docs/tuning.md says more.
"""


def tune(  # noqa: PLR0913 - each is an option of the command
    mission: Annotated[str, typer.Argument(help="mission file, or a shipped mission's name")],
    try_: Annotated[
        list[str],
        typer.Option(
            "--try",
            metavar="NAME=LOW..HIGH",
            help="a parameter and its range, or values: NAME=A,B; several of them",
        ),
    ],
    samples: Annotated[int, typer.Option(min=1, help="settings to try, beside the baseline")] = 20,
    seeds: Annotated[int, typer.Option(min=1, help="runs of each setting")] = 3,
    refine: Annotated[
        int, typer.Option(min=0, help="then so many turns of half as many, round the best third")
    ] = 0,
    confirm: Annotated[
        int, typer.Option(min=0, help="seeds on which the best must prove itself at the end")
    ] = 3,
    jobs: Annotated[int, typer.Option(min=1, help="processes")] = 1,
    out: Annotated[
        Path | None, typer.Option(help="the table's folder [default: tune/<mission>]")
    ] = None,
    weight: Annotated[
        list[str] | None,
        typer.Option(metavar="MEASURE=NUMBER", help="what counts how much, e.g. time=2"),
    ] = None,
    time_limit: Annotated[
        str, typer.Option(metavar="DURATION", help="simulated time after which a run has failed")
    ] = "15 min",
    sampling_seed: Annotated[int, typer.Option(min=0, help="another one, other samples")] = 0,
    robot: Annotated[str | None, typer.Option(help="another robot: a name or a robot.yaml")] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission argument")
    ] = None,
) -> None:
    """Score settings of planner, controller, costmap… in the simulation, and keep the best."""
    from missions.bench.mission_runs import MissionEntry
    from missions.tuning.findings import table_lines, write_findings
    from missions.tuning.scoring import read_weights
    from missions.tuning.tuning import TuneOptions, Tuning

    folder = out or Path("tune") / Path(mission).stem
    limit = duration(time_limit, "--time-limit")
    options = TuneOptions(
        folder, jobs, samples, seeds, refine, confirm, limit, sampling_seed,
        read_weights(assignments(weight or [], "--weight", "time=2")),
    )  # fmt: skip
    entry = MissionEntry(mission, 0, limit, assignments(set_ or []), robot)
    ranges = assignments(try_, "--try", "controller.cruise_speed=0.4..0.8")
    tuning = Tuning(entry, ranges, options, _tell)
    try:
        tuned = tuning.run()
    except KeyboardInterrupt:
        _tell(f"interrupted; what has been run is in {folder}, the same command goes on from there")
        if tuning.has_baseline:
            for line in table_lines(tuning.so_far()):
                typer.echo(line)
        raise typer.Exit(INTERRUPTED) from None
    for line in table_lines(tuned):
        typer.echo(line)
    for file in write_findings(tuned, folder):
        _tell(f"wrote {file}")


def duration(text: str, option: str) -> float:
    """Seconds, above 0.

    Raises:
        InputError: something else.
    """
    from stack.errors import InputError, ParameterError
    from stack.parameters import Declaration

    try:
        seconds: float = Declaration("duration", float, unit="s", above=0.0).read(text)
    except ParameterError as error:
        raise InputError(f"{option} {text}: {error.sentence}") from None
    return seconds


def _tell(line: str) -> None:
    typer.echo(line, err=True)
