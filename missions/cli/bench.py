"""`treepilot bench`: measures how well a robot drives. A part of missions.cli.app."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import assignments

HELP = """Measure how well robots drive; docs/benchmarks.md says what the figures mean.

Tables go to bench/NAME: a run a line in runs.jsonl, a picture of each failure in failures/, what
was set in settings.json. A bench that was interrupted goes on where it stopped; after a change of
treepilot itself choose another --out.
"""

bench_app = typer.Typer(no_args_is_help=True, help=HELP)

Trials = Annotated[int, typer.Option(min=1, help="runs in each world; trial n has seed n")]
Jobs = Annotated[int, typer.Option(min=1, help="processes")]
Controllers = Annotated[
    str,
    typer.Option(
        "--controllers", "--controller", metavar="NAMES",
        help="one after the other, such as pure_pursuit,mppi [default: the mission's]",
    ),
]  # fmt: skip
Out = Annotated[Path, typer.Option(help="the table's folder; an interrupted bench goes on there")]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission argument")
]


Parameter = Annotated[
    list[str] | None, typer.Option(metavar="NAME=VALUE", help="as `treepilot run` takes it")
]


@bench_app.command("barn")
def barn(  # noqa: PLR0913 - each is an option of the command
    worlds: Annotated[
        Path, typer.Option(help="folder of .world files, one of them, or a .json of grids")
    ],
    trials: Trials = 1,
    jobs: Jobs = 1,
    out: Out = Path("bench/barn"),
    only: Annotated[str, typer.Option(metavar="NAMES", help="worlds, such as 3,17,200")] = "",
    controllers: Controllers = "",
    mission: Annotated[str, typer.Option(help="another mission with the argument goal")] = "",
    set_: Settings = None,
    parameter: Parameter = None,
) -> None:
    """Cross unknown, narrow worlds and score it as the BARN Challenge does."""
    from missions.bench.barn import barn_entries, report
    from missions.bench.barn_score import RULES
    from missions.bench.runs import Setup
    from missions.bench.table import TableOptions, fill_table
    from missions.execution.resources import MISSIONS

    file, arguments = mission or str(MISSIONS / "bench" / "barn.yaml"), assignments(set_ or [])
    given = assignments(parameter or [], "--parameter", "controller.cruise_speed=1.2")
    setups = [
        Setup(file, RULES, arguments, controller=name, parameters=given)
        for name in named(controllers) or (None,)
    ]
    entries = barn_entries(worlds, setups, trials, named(only))
    _print(report(fill_table(entries, TableOptions(out, jobs), _tell)))


@bench_app.command("courses")
def courses(  # noqa: PLR0913 - each is an option of the command
    course: Annotated[
        str,
        typer.Option(
            metavar="NAMES", help="some of door, s_bend, corner, dead_end, clutter [default: all]"
        ),
    ] = "",
    robots: Annotated[
        str, typer.Option("--robots", "--robot", metavar="NAMES", help="names or robot.yaml files")
    ] = "scout,jackal",
    controllers: Controllers = "",
    trials: Trials = 20,
    jobs: Jobs = 1,
    out: Out = Path("bench/courses"),
) -> None:
    """Drive through narrow passages made to the robot's measure, with default parameters.

    A passage is a little different in each trial. It is passed when the mission says so, at the
    goal, within two minutes and without any contact.
    """
    from missions.bench.course_bench import CourseOptions, course_entries, report
    from missions.bench.table import TableOptions, fill_table

    options = CourseOptions(
        out / "worlds", named(course), named(robots), named(controllers), trials
    )  # fmt: skip
    entries = course_entries(options)
    _print(report(fill_table(entries, TableOptions(out, jobs), _tell)))


@bench_app.command("missions")
def missions(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="mission files or shipped missions' names [default: all shipped]"),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="runs of each mission")] = 10,
    jobs: Jobs = 1,
    out: Out = Path("bench/missions"),
    robot: Annotated[str | None, typer.Option(help="another robot: a name or a robot.yaml")] = None,
) -> None:
    """Run missions to their own end over seeds: success, time, contacts, clearance, pose error.

    Success is what the mission says, within two simulated hours. `treepilot tune` runs the same
    with different settings. Results are kept by mission text, world, robot and settings: after a
    change of treepilot itself choose another --out.
    """
    from missions.bench.mission_table import measured, mission_entries, table_lines
    from missions.bench.resumable import TableOptions

    entries = mission_entries(names or (), seeds, robot)
    _print(list(table_lines(measured(entries, TableOptions(out, jobs), _tell))))


@bench_app.command("dyna")
def dyna(  # noqa: PLR0913 - each is an option of the command
    worlds: Annotated[int, typer.Option(min=1, help="how many of the 20, spread evenly")] = 20,
    trials: Trials = 1,
    controllers: Annotated[
        str,
        typer.Option("--controllers", "--controller", metavar="NAMES", help="one after the other"),
    ] = "pure_pursuit,mppi,dwb",
    robot: Annotated[str, typer.Option(help="a name or a robot.yaml")] = "jackal",
    jobs: Jobs = 1,
    out: Out = Path("bench/dyna"),
    mission: Annotated[str, typer.Option(help="another mission to the place goal")] = "",
    parameter: Parameter = None,
) -> None:
    """Cross a field of 10 to 20 cylinders that move at up to 1.7 m/s and wait for nobody.

    Each controller is set to 1.8 m/s, since the cylinders are faster than the usual 0.8 m/s.
    It is reached within 1 m and 100 s without a contact. A cylinder that runs into the robot as it
    stands is counted apart from what the robot runs into.
    """
    from missions.bench.dyna_bench import MISSION, dyna_entries, dyna_setups, report
    from missions.bench.table import TableOptions, fill_table

    given = assignments(parameter or [], "--parameter", "controller.cruise_speed=1.2")
    setups = dyna_setups(
        named(controllers) or ("pure_pursuit",), robot, mission or str(MISSION), given
    )
    entries = dyna_entries(setups, worlds, trials, out / "worlds")
    _print(report(fill_table(entries, TableOptions(out, jobs), _tell)))


@bench_app.callback()
def _bench() -> None:
    """Measure how well robots drive."""


def named(words: str) -> tuple[str, ...]:
    """Names between commas."""
    return tuple(word.strip() for word in words.split(",") if word.strip())


def _tell(line: str) -> None:
    typer.echo(line, err=True)


def _print(lines: list[str]) -> None:
    for line in lines:
        typer.echo(line)
