"""`treepilot tune`: searches parameter values that improve a mission."""

from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import OtherRobot, Settings, assignments
from missions.cli.sweep_runs import Cluster, check_cluster, interruptible, tell
from stack.errors import InputError, ParameterError

MOST_RUNS = 1_000_000
"""Runs of a tuning at most."""

EPILOG = """
\b
  treepilot tune 01_drive_to_a_point --try controller.cruise_speed=0.4..0.8 --jobs 2
  treepilot tune my.yaml --try controller.lookahead_time="0.8 s..1.6 s" \\
      --try planner.smoother=simple,constrained --samples 60 --weight clearance=2
  treepilot tune my.yaml --try controller.cruise_speed=0.3..0.9 \\
      --minimise time --maximise clearance

`treepilot parameters MISSION` lists the parameters, `treepilot describe pure_pursuit` their
ranges. The settings are compared with the unchanged mission: the baseline. The cost of a run is

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

--minimise and --maximise take these names, `cost` and `success`. Several of them give a front: the
settings that no other one beats in every objective.

Output: report.html, table.txt, scores.json, runs.parquet (every run), and best.yaml, or
front-N.yaml of a front, for the `parameters:` key of the mission. After Ctrl-C the same command
resumes; more samples add to the results. See docs/tuning.md.
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
    minimise: Annotated[
        list[str] | None,
        typer.Option(metavar="MEASURE", help="objective; repeatable [default: cost]"),
    ] = None,
    maximise: Annotated[
        list[str] | None, typer.Option(metavar="MEASURE", help="objective; repeatable")
    ] = None,
    samples: Annotated[int, typer.Option(min=1, help="settings to try besides the baseline")] = 20,
    seeds: Annotated[int, typer.Option(min=1, help="runs per setting")] = 3,
    confirm: Annotated[
        int, typer.Option(min=0, help="seeds held out, on which the best settings are compared")
    ] = 3,
    jobs: Annotated[int | None, typer.Option(min=1, help="parallel processes [default: 1]")] = None,
    cluster: Cluster = None,
    out: Annotated[
        Path | None, typer.Option(help="output folder [default: tune/<mission>]")
    ] = None,
    weight: Annotated[
        list[str] | None,
        typer.Option(metavar="MEASURE=NUMBER", help="weight of a measure in the cost, e.g. time=2"),
    ] = None,
    time_limit: Annotated[
        str, typer.Option(metavar="DURATION", help="simulated time after which a run fails")
    ] = "15 min",
    sampling_seed: Annotated[int, typer.Option(min=0, help="seed of the sampling")] = 0,
    robot: OtherRobot = None,
    set_: Settings = None,
) -> None:
    """Search parameter values in simulation and keep the best."""
    from missions.sweeps.checking import checked
    from missions.sweeps.factors import read_factor
    from missions.sweeps.runner import ExecutionSettings
    from missions.sweeps.sweep import NONE, Sweep
    from missions.tuning.objectives import read_objectives, read_weights
    from missions.tuning.results import table_lines, write_findings
    from missions.tuning.tuning import TuneOptions, Tuning
    from stack.optional_packages import OPTUNA

    OPTUNA.require("`treepilot tune` needs")
    check_cluster(cluster, jobs)
    folder = out or Path("tune") / Path(mission).stem
    weights = read_weights(assignments(weight or [], "--weight", "time=2"))
    objectives = read_objectives(minimise or [], maximise or [], weights)
    ranges = assignments(try_, "--try", "controller.cruise_speed=0.4..0.8")
    factors = []
    for name, text in ranges.items():
        try:
            factors.append(read_factor(name, text))
        except InputError as error:
            raise InputError(f"--try {name}={text}: {error}") from None
    sweep = Sweep(
        mission, MOST_RUNS, "optuna", tuple(factors), arguments=assignments(set_ or []),
        robot=robot, time_limit=duration(time_limit, "--time-limit"), keep=NONE,
    )  # fmt: skip
    ready = checked(sweep, lambda one, error: InputError(f"--try {one.name}: {error}"))
    with interruptible(folder) as check:
        execution = ExecutionSettings(jobs or 1, cluster=cluster or "", check=check)
        options = TuneOptions(
            folder, objectives, samples, seeds, confirm, sampling_seed, execution
        )  # fmt: skip
        tuning = Tuning(ready, options, tell)
        try:
            tuned = tuning.run()
        except KeyboardInterrupt:
            if tuning.has_baseline:
                for line in table_lines(tuning.so_far()):
                    typer.echo(line)
            raise
    for line in table_lines(tuned):
        typer.echo(line)
    for file in write_findings(tuned, folder):
        tell(f"wrote {file}")


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
