"""`treepilot bench`: benchmarks of driving in simulation."""

from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import assignments

HELP = """Measure driving in benchmark worlds.

Results go to bench/NAME: one line per run in runs.jsonl, a picture of each failure in failures/,
the settings in settings.json. An interrupted bench resumes; after a change of treepilot itself
choose another --out. See docs/benchmarks.md.
"""

bench_app = typer.Typer(no_args_is_help=True, help=HELP)

Trials = Annotated[int, typer.Option(min=1, help="runs per world; trial n uses seed n")]
Jobs = Annotated[int, typer.Option(min=1, help="parallel processes")]
Controllers = Annotated[
    str,
    typer.Option(
        "--controllers", "--controller", metavar="NAMES",
        help="controllers to compare, e.g. pure_pursuit,mppi [default: the mission's]",
    ),
]  # fmt: skip
Out = Annotated[Path, typer.Option(help="output folder; an interrupted bench resumes there")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="set a mission argument; repeatable"),
]
Parameter = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=VALUE", help="override a parameter, as in `treepilot run`"),
]
Robots = Annotated[
    str,
    typer.Option("--robots", "--robot", metavar="NAMES", help="robots: names or robot.yaml files"),
]
People = Annotated[
    str, typer.Option(metavar="KINDS", help="any of none, social_force, polite, unaware")
]
Keep = Annotated[
    Path | None, typer.Option(help="folder for the records of each run [default: none]")
]


@bench_app.command("barn")
def barn(  # noqa: PLR0913 - each is an option of the command
    worlds: Annotated[
        Path, typer.Option(help="folder of .world files, one .world file, or a .json of grids")
    ],
    trials: Trials = 1,
    jobs: Jobs = 1,
    out: Out = Path("bench/barn"),
    only: Annotated[
        str, typer.Option(metavar="NAMES", help="only these worlds, e.g. 3,17,200")
    ] = "",
    controllers: Controllers = "",
    mission: Annotated[str, typer.Option(help="use another mission with an argument `goal`")] = "",
    set_: Settings = None,
    parameter: Parameter = None,
) -> None:
    """Cross unknown narrow worlds, scored as in the BARN Challenge."""
    from missions.bench.barn import barn_entries, report
    from missions.bench.barn_score import RULES
    from missions.bench.runs import Setup, with_controller
    from missions.bench.table import TableOptions, fill_table
    from missions.execution.resources import MISSIONS
    from missions.run_options import RunOptions

    file, arguments = mission or str(MISSIONS / "bench" / "barn.yaml"), assignments(set_ or [])
    given = _overrides(parameter, "controller.cruise_speed=1.2")
    setups = [
        Setup(file, RULES, RunOptions(arguments=arguments, parameters=with_controller(name, given)))
        for name in named(controllers) or (None,)
    ]
    entries = barn_entries(worlds, setups, trials, named(only))
    _print(report(fill_table(entries, TableOptions(out, jobs), _tell)))


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
    controllers: Controllers = "",
    trials: Trials = 20,
    jobs: Jobs = 1,
    out: Out = Path("bench/courses"),
) -> None:
    """Drive through narrow passages sized for the robot.

    Parameters are the defaults. The passage varies with the trial. A trial passes when the mission
    succeeds at the goal within two minutes and without a contact.
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
        typer.Argument(help="mission files or names of shipped missions [default: all shipped]"),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="runs per mission")] = 10,
    jobs: Jobs = 1,
    out: Out = Path("bench/missions"),
    robot: Annotated[
        str | None, typer.Option(help="use another robot: a name or a robot.yaml")
    ] = None,
) -> None:
    """Run whole missions over several seeds.

    Reports success, time, contacts, clearance and pose error. A run succeeds when its mission does,
    within two simulated hours. Results are stored by mission text, world, robot and settings; after
    a change of treepilot itself choose another --out.
    """
    from missions.bench.mission_table import measured, mission_entries, table_lines
    from missions.bench.resumable import TableOptions

    entries = mission_entries(names or (), seeds, robot)
    _print(list(table_lines(measured(entries, TableOptions(out, jobs), _tell))))


@bench_app.command("dyna")
def dyna(  # noqa: PLR0913 - each is an option of the command
    worlds: Annotated[
        int, typer.Option(min=1, help="number of worlds, spread evenly over the 20")
    ] = 20,
    trials: Trials = 1,
    controllers: Annotated[
        str,
        typer.Option(
            "--controllers", "--controller", metavar="NAMES", help="controllers to compare"
        ),
    ] = "pure_pursuit,mppi,dwb",
    robot: Annotated[str, typer.Option(help="robot: a name or a robot.yaml")] = "jackal",
    jobs: Jobs = 1,
    out: Out = Path("bench/dyna"),
    mission: Annotated[
        str, typer.Option(help="use another mission that drives to the place `goal`")
    ] = "",
    parameter: Parameter = None,
) -> None:
    """Cross a field of moving cylinders that do not avoid the robot.

    10 to 20 cylinders move at up to 1.7 m/s, so controllers are set to 1.8 m/s instead of the usual
    0.8 m/s. A trial succeeds within 1 m of the goal in 100 s without a contact. Cylinders that hit
    the standing robot are counted apart.
    """
    from missions.bench.dyna_bench import MISSION, dyna_entries, dyna_setups, report
    from missions.bench.table import TableOptions, fill_table

    given = _overrides(parameter, "controller.cruise_speed=1.2")
    setups = dyna_setups(
        named(controllers) or ("pure_pursuit",), robot, mission or str(MISSION), given
    )
    entries = dyna_entries(setups, worlds, trials, out / "worlds")
    _print(report(fill_table(entries, TableOptions(out, jobs), _tell)))


@bench_app.command("localisation")
def localisation(  # noqa: PLR0913 - each is an option of the command
    experiments: Annotated[
        list[str] | None,
        typer.Argument(help="experiments, e.g. flat pushed [default: all]"),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="runs of each experiment")] = 20,
    only: Annotated[
        int | None, typer.Option(metavar="SEED", min=0, help="only this seed, to repeat a case")
    ] = None,
    hold_out: Annotated[
        bool, typer.Option("--hold-out", help="use the hold-out seeds, from 9000 on")
    ] = False,
    jobs: Jobs = 1,
    out: Out = Path("bench/localisation"),
    parameter: Parameter = None,
) -> None:
    """Measure the localisation in generated worlds against the truth.

    Tracking in offices, warehouses and flats with unmapped furniture and people, a featureless
    corridor, pushes, kidnaps, unknown starts, twin rooms, and the calibration of the health.
    Failed runs are drawn in failures/, each with the command that repeats it.
    """
    from missions.bench.localisation.experiments import LocalisationEntry, entries_of
    from missions.bench.localisation.report import measured, report
    from missions.bench.resumable import TableOptions

    given = _overrides(parameter, "localisation.beams=90")
    entries = entries_of(tuple(experiments or ()), seeds, out / "worlds", hold_out=hold_out)
    if only is not None:
        names = dict.fromkeys(entry.experiment for entry in entries)
        entries = [LocalisationEntry(name, only, out / "worlds") for name in names]
    _print(report(measured(entries, given, TableOptions(out, jobs), _tell)))


@bench_app.command("flats")
def flats(  # noqa: PLR0913 - each is an option of the command
    worlds: Annotated[int, typer.Option(min=1, help="number of worlds")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="seed of the first world")] = 0,
    robots: Robots = "scout",
    people: People = "none,social_force,unaware",
    jobs: Jobs = 1,
    out: Out = Path("bench/flats"),
    keep: Keep = None,
    parameter: Parameter = None,
) -> None:
    """Drive to four goals in random flats and offices with people.

    A fifth of the furniture is not on the map. People walk by social forces, on loops with a stop
    for robots ahead (polite), or on loops and react to nobody (unaware). Parameters are the
    defaults. A run passes when all goals are reached. Contacts are counted by who moved into whom;
    time and way are compared with the runs without people, if there are any.
    """
    from missions.bench.people.table import flat_entries, measured, report, rows_of
    from missions.bench.resumable import TableOptions

    given = _overrides(parameter, "controller.cruise_speed=1.2")
    seeds = range(seed, seed + worlds)
    entries = flat_entries(named(robots), named(people), seeds, out / "worlds", given, keep)
    rows = measured(entries, TableOptions(out, jobs), _tell)
    _print(report(rows, rows_of(rows)))


@bench_app.command("people")
def people(  # noqa: PLR0913 - each is an option of the command
    scenes: Annotated[
        list[str] | None,
        typer.Argument(help="begins of the names of scenes, e.g. corridor crowd [default: all]"),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="runs of each scene")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="first seed")] = 0,
    tracks: Annotated[
        list[Path] | None,
        typer.Option(help="file of recorded tracks (frame, person, x, y); repeatable"),
    ] = None,
    robots: Robots = "scout",
    people: People = "none,social_force,unaware",
    jobs: Jobs = 1,
    out: Out = Path("bench/people"),
    keep: Keep = None,
    parameter: Parameter = None,
) -> None:
    """Meet people: in corridors, at doors, crossings, in a crowd, in an office.

    Corridors of 1.2 to 2.4 m between two rooms with one, two or four people oncoming or one ahead,
    a door of 0.9 m, two corridors that cross, 20 people in a hall of 12 x 12 m, a patrol of the
    office with five people, and recorded tracks. A run passes when all goals are reached. Contacts
    are counted by who moved into whom. Kinds of people as in `bench flats`.
    """
    from missions.bench.people.scenes import scene_names
    from missions.bench.people.table import measured, report, scene_entries, scene_rows
    from missions.bench.resumable import TableOptions

    given = _overrides(parameter, "controller.cruise_speed=1.2")
    names = scene_names(tuple(scenes or ()), tuple(tracks or ()))
    entries = scene_entries(
        names, named(robots), named(people), range(seed, seed + seeds), out / "worlds", given, keep
    )
    rows = measured(entries, TableOptions(out, jobs), _tell)
    _print(report(rows, scene_rows(rows)))


@bench_app.command("line")
def line(  # noqa: PLR0913 - each is an option of the command
    courses: Annotated[int, typer.Option(min=1, help="number of courses")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="seed of the first course")] = 0,
    robots: Robots = "scout",
    speed: Annotated[float, typer.Option(min=0.05, max=2.0, help="speed in m/s")] = 0.4,
    jobs: Jobs = 1,
    out: Out = Path("bench/line"),
    parameter: Parameter = None,
) -> None:
    """Follow random lines on the floor with the camera, in dim, normal and bright light.

    A course has six curves of 0.6 to 1.6 m radius, a gap of 20 to 40 cm, a junction whose branch is
    told, and an end mark. A run passes when the robot stops at the mark. The distance is that of
    its true position from the line.
    """
    from missions.bench.perception.line_runs import line_entries, measured, report
    from missions.bench.resumable import TableOptions

    given = _overrides(parameter, "safety.top_speed=0.3")
    seeds = range(seed, seed + courses)
    entries = line_entries(named(robots), seeds, out / "worlds", speed, given)
    _print(report(measured(entries, TableOptions(out, jobs), _tell)))


@bench_app.command("docking")
def docking(  # noqa: PLR0913 - each is an option of the command
    starts: Annotated[int, typer.Option(min=1, help="number of starts")] = 50,
    seed: Annotated[int, typer.Option(min=0, help="seed of the first start")] = 0,
    robots: Robots = "scout",
    jobs: Jobs = 1,
    out: Out = Path("bench/docking"),
    parameter: Parameter = None,
) -> None:
    """Dock at a charger from random starts within 3 m, with a wrong initial pose.

    A run passes when the battery charges. The error is that of the true pose at the end.
    """
    from missions.bench.perception.docking_runs import docking_entries, measured, report
    from missions.bench.resumable import TableOptions

    given = _overrides(parameter, "safety.top_speed=0.3")
    entries = docking_entries(named(robots), range(seed, seed + starts), out / "worlds", given)
    _print(report(measured(entries, TableOptions(out, jobs), _tell)))


@bench_app.command("follow")
def follow(  # noqa: PLR0913 - each is an option of the command
    seeds: Annotated[int, typer.Option(min=1, help="number of runs")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="seed of the first run")] = 0,
    robots: Robots = "scout",
    jobs: Jobs = 1,
    out: Out = Path("bench/follow"),
    parameter: Parameter = None,
) -> None:
    """Follow a guide through doors, past a person who crosses, and round a corner (mission 35).

    A run passes when the robot is with the guide at the end. The gap is that of the true outlines.
    """
    from missions.bench.perception.follow_runs import follow_entries, measured, report
    from missions.bench.resumable import TableOptions

    given = _overrides(parameter, "safety.top_speed=0.3")
    entries = follow_entries(named(robots), range(seed, seed + seeds), given)
    _print(report(measured(entries, TableOptions(out, jobs), _tell)))


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
    _print([f"{file}: {len(plan.rooms)} rooms, places {', '.join(plan.places)}"])


@bench_app.callback()
def _bench() -> None:
    """Measure driving in benchmark worlds."""


def named(words: str) -> tuple[str, ...]:
    """Split a comma-separated list of names."""
    return tuple(word.strip() for word in words.split(",") if word.strip())


def _overrides(given: list[str] | None, example: str) -> dict[str, str]:
    return assignments(given or [], "--parameter", example)


def _tell(line: str) -> None:
    typer.echo(line, err=True)


def _print(lines: list[str]) -> None:
    for line in lines:
        typer.echo(line)
