"""`treepilot bench`: benchmarks of driving in simulation."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.arguments import OtherRobot, Parameters, assignments

if TYPE_CHECKING:
    from missions.bench.bench import Bench, E, Options, R

HELP = """Measure driving in benchmark worlds.

Results go to bench/NAME: one line per run in runs.jsonl, the settings in settings.json, a picture
of each failed run of courses and flats in failures/. An interrupted bench resumes;
after a change of treepilot itself choose another --out. See docs/benchmarks.md.
"""

bench_app = typer.Typer(no_args_is_help=True, help=HELP)

Jobs = Annotated[int, typer.Option(min=1, help="parallel processes")]
Out = Annotated[Path, typer.Option(help="output folder; an interrupted bench resumes there")]
Robots = Annotated[
    str,
    typer.Option("--robots", "--robot", metavar="NAMES", help="robots: names or robot.yaml files"),
]


@bench_app.command("courses")
def courses(  # noqa: PLR0913 - each is an option of the command
    course: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="only these of door, s_bend, corner, dead_end, clutter [default: all]",
        ),
    ] = "",
    robots: Robots = "scout,jackal",
    controllers: Annotated[
        str,
        typer.Option(
            "--controllers",
            "--controller",
            metavar="NAMES",
            help="controllers to compare, e.g. pure_pursuit,mppi [default: the mission's]",
        ),
    ] = "",
    trials: Annotated[int, typer.Option(min=1, help="runs per world; trial n uses seed n")] = 20,
    jobs: Jobs = 1,
    out: Out = Path("bench/courses"),
) -> None:
    """Drive through narrow passages sized for the robot.

    Parameters are the defaults. The passage varies with the trial. A trial passes when the mission
    succeeds at the goal within two minutes and without a contact.
    """
    from missions.bench.bench import Options
    from missions.bench.course_bench import COURSE_BENCH

    _measure(COURSE_BENCH, Options(
        out, jobs, range(trials), named(course), named(robots), named(controllers)
    ))  # fmt: skip


@bench_app.command("missions")
def missions(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="mission files or names of shipped missions [default: all shipped]"),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="runs per mission")] = 10,
    jobs: Jobs = 1,
    out: Out = Path("bench/missions"),
    robot: OtherRobot = None,
) -> None:
    """Run whole missions over several seeds.

    Reports success, time, contacts, clearance and pose error. A run succeeds when its mission does,
    within two simulated hours. It is a sweep over missions and seeds: the folder has its table,
    and records of the failures; `treepilot sweep report` writes its page.
    """
    from missions.bench.bench import Options
    from missions.cli.sweep_runs import interruptible, progress, tell
    from missions.sweeps.mission_table import measured, report_lines, sweep_of

    robots = () if robot is None else (robot,)
    options = Options(out, jobs, range(seeds), tuple(names or ()), robots)
    shown = progress(sweep_of(options).runs)
    with interruptible(out) as check:
        rows = measured(options, shown.update, check)
    tell(shown.line(rows))
    for line in report_lines(rows):
        typer.echo(line)


@bench_app.command("flats")
def flats(  # noqa: PLR0913 - each is an option of the command
    worlds: Annotated[int, typer.Option(min=1, help="number of worlds")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="seed of the first world")] = 0,
    robots: Robots = "scout",
    people: Annotated[
        str, typer.Option(metavar="KINDS", help="any of none, social_force, polite, unaware")
    ] = "none,social_force,unaware",
    jobs: Jobs = 1,
    out: Out = Path("bench/flats"),
    keep: Annotated[
        Path | None, typer.Option(help="folder for the records of each run [default: none]")
    ] = None,
    parameter: Parameters = None,
) -> None:
    """Drive to four goals in random flats and offices with people.

    A fifth of the furniture is not on the map. People walk by social forces, on loops with a stop
    for robots ahead (polite), or on loops and react to nobody (unaware). Parameters are the
    defaults. A run passes when all goals are reached. Contacts are counted by who moved into whom;
    time and way are compared with the runs without people, if there are any.
    """
    from missions.bench.bench import Options
    from missions.bench.flats import FLATS

    _measure(FLATS, Options(
        out, jobs, range(seed, seed + worlds), robots=named(robots), people=named(people),
        parameters=assignments(parameter or [], "--parameter", "controller.cruise_speed=1.2"),
        keep=keep,
    ))  # fmt: skip


@bench_app.command("world")
def world(  # noqa: PLR0913 - each is an option of the command
    kind: Annotated[str, typer.Argument(help="flat, office, warehouse, hotel, twin, corridor")],
    seed: Annotated[int, typer.Option(min=0, help="seed of the world")] = 0,
    rooms: Annotated[
        int, typer.Option(min=0, help="rooms, or rows of shelves; 0 draws the number")
    ] = 0,
    people: Annotated[int, typer.Option(min=0, help="people who walk along loops")] = 0,
    unmapped: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="share of the furniture that maps do not show")
    ] = 0.0,
    out: Annotated[Path, typer.Option(help="folder of the world file")] = Path("bench/worlds"),
) -> None:
    """Write a generated world, for `treepilot run MISSION --world FILE`.

    The same options give the same world. In every world the robot scout reaches every room.
    """
    from missions.bench.generation.worlds import WorldOptions, generate

    plan = generate(WorldOptions(kind, seed, rooms, people, unmapped))
    plan.keep_clear(next(iter(plan.places.values())))
    out.mkdir(parents=True, exist_ok=True)
    file = out / f"{plan.name}.yaml"
    file.write_text(plan.text(), "utf-8")
    typer.echo(f"{file}: {len(plan.rooms)} rooms, places {', '.join(plan.places)}")


@bench_app.callback()
def _bench() -> None:
    """Measure driving in benchmark worlds."""


def named(words: str) -> tuple[str, ...]:
    """Split a comma-separated list of names."""
    return tuple(word.strip() for word in words.split(",") if word.strip())


def _measure(bench: "Bench[E, R]", options: "Options") -> None:
    """Fill the table of a bench and print it."""
    from missions.bench.run_table import measured

    rows = measured(bench, options, lambda line: typer.echo(line, err=True))
    for line in bench.report(rows):
        typer.echo(line)
