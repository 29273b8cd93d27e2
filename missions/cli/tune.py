"""`treepilot tune`: searches parameter values that improve a mission."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import OtherRobot, Settings, assignments
from missions.cli.sweep_runs import INTERRUPTED
from stack.errors import InputError, ParameterError

EPILOG = """
\b
  treepilot tune 01_drive_to_a_point --try controller.cruise_speed=0.4..0.8 --jobs 2
  treepilot tune my.yaml --try controller.lookahead_time="0.8 s..1.6 s" \\
      --try planner.smoother=simple,constrained --refine 2 --weight clearance=2

`treepilot parameters MISSION` lists the parameters, `treepilot describe pure_pursuit` their
ranges. The first sample is the unchanged mission: the baseline. The cost of a run is

\b
  sum(weight * value / baseline value) / sum(weights) + collision weight * collisions

with the inverse ratio for clearance: 1 is as good as the baseline, 0.9 is 10 % better. A failed run
costs 10, more than any successful run. Measures and default weights:

\b
  time 1           simulated time of the mission
  detour 0.5       path length driven / shortest path through the goals reached
  clearance 0.5    smallest true distance to an obstacle
  turning 0.5      mean change of the commanded angular velocity
  jerk 0.25        root mean square of the commanded jerk
  goal_error 0.5   true distance to the goal after each stop
  collisions 1     contacts of the moving robot

Output: runs.jsonl (every run), table.txt, scores.json, and best.yaml for the `parameters:` key of
the mission. After Ctrl-C the same command resumes; more samples, seeds or other ranges add to the
results. See docs/tuning.md.
"""


def tune(  # noqa: PLR0913 - each is an option of the command
    mission: Annotated[str, typer.Argument(help="mission file, or the name of a shipped mission")],
    try_: Annotated[
        list[str],
        typer.Option(
            "--try",
            metavar="NAME=LOW..HIGH",
            help="parameter and range, or values: NAME=A,B; repeatable",
        ),
    ],
    samples: Annotated[int, typer.Option(min=1, help="settings to try besides the baseline")] = 20,
    seeds: Annotated[int, typer.Option(min=1, help="runs per setting")] = 3,
    refine: Annotated[
        int,
        typer.Option(
            min=0, help="refinement rounds around the best third, each with half the samples"
        ),
    ] = 0,
    confirm: Annotated[
        int, typer.Option(min=0, help="new seeds on which the best setting is confirmed")
    ] = 3,
    jobs: Annotated[int, typer.Option(min=1, help="parallel processes")] = 1,
    out: Annotated[
        Path | None, typer.Option(help="output folder [default: tune/<mission>]")
    ] = None,
    weight: Annotated[
        list[str] | None,
        typer.Option(metavar="MEASURE=NUMBER", help="weight of a measure, e.g. time=2"),
    ] = None,
    time_limit: Annotated[
        str, typer.Option(metavar="DURATION", help="simulated time after which a run fails")
    ] = "15 min",
    sampling_seed: Annotated[int, typer.Option(min=0, help="seed of the sampling")] = 0,
    robot: OtherRobot = None,
    set_: Settings = None,
) -> None:
    """Search parameter values in simulation and keep the best."""
    from missions.bench.mission_runs import QUIET, MissionEntry
    from missions.tuning.results import table_lines, write_findings
    from missions.tuning.scoring import read_weights
    from missions.tuning.tuning import TuneOptions, Tuning

    folder = out or Path("tune") / Path(mission).stem
    limit = duration(time_limit, "--time-limit")
    options = TuneOptions(
        folder, jobs, samples, seeds, refine, confirm, limit, sampling_seed,
        read_weights(assignments(weight or [], "--weight", "time=2")),
    )  # fmt: skip
    chosen = replace(QUIET, arguments=assignments(set_ or []), robot=robot)
    entry = MissionEntry(mission, limit, chosen)
    ranges = assignments(try_, "--try", "controller.cruise_speed=0.4..0.8")
    tuning = Tuning(entry, ranges, options, _tell)
    try:
        tuned = tuning.run()
    except KeyboardInterrupt:
        _tell(f"interrupted; finished runs are in {folder}, the same command resumes")
        if tuning.has_baseline:
            for line in table_lines(tuning.so_far()):
                typer.echo(line)
        raise typer.Exit(INTERRUPTED) from None
    for line in table_lines(tuned):
        typer.echo(line)
    for file in write_findings(tuned, folder):
        _tell(f"wrote {file}")


def duration(text: str, option: str) -> float:
    """Read a duration in seconds, above 0.

    Raises:
        InputError: not a positive duration.
    """
    from stack.parameters import Declaration

    try:
        seconds: float = Declaration("duration", float, unit="s", above=0.0).read(text)
    except ParameterError as error:
        raise InputError(f"{option} {text}: {error.sentence}") from None
    return seconds


def _tell(line: str) -> None:
    typer.echo(line, err=True)
