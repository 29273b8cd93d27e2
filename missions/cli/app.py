"""The `treepilot` command: words in, exit codes out. It and `launch` are where things are printed.

Exit codes: 0 success · 1 the mission failed or was aborted · 2 the input is wrong ·
3 internal error · 130 interrupted.
"""

from __future__ import annotations

import os
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # halves numpy's import time; before numpy

import typer

from missions.cli.bench import assignments, bench_app
from missions.cli.new import new_app
from missions.cli.tell import tell_app
from missions.cli.tune import EPILOG as TUNE_EPILOG
from missions.cli.tune import tune
from stack.errors import BodyError, InputError, ParameterError, TelemetryError

HELP = """Run behaviour-tree missions on a simulated or a real robot.

Start with: treepilot run missions/02_office_patrol.yaml
"""

app = typer.Typer(
    help=HELP, no_args_is_help=True, add_completion=False, rich_markup_mode=None,
    pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip


class Kind(StrEnum):
    """What `treepilot list` lists."""

    BEHAVIOURS = "behaviours"
    ROBOTS = "robots"
    WORLDS = "worlds"
    MISSIONS = "missions"
    PLANNERS = "planners"
    CONTROLLERS = "controllers"
    LAYERS = "layers"


class SchemaKind(StrEnum):
    """What `treepilot schema` knows."""

    MISSION = "mission"
    WORLD = "world"
    ROBOT = "robot"


class Camera(StrEnum):
    """When the camera renders."""

    ASKED = "asked"
    ON = "on"
    OFF = "off"


MissionArgument = Annotated[str, typer.Argument(help="mission file, or a shipped mission's name")]

PluginsOf = Annotated[
    str | None, typer.Option("--mission", metavar="FILE", help="with the plugins of this mission")
]


@app.command()
def run(  # noqa: PLR0913 - each is an option of the command
    mission: MissionArgument,
    headless: Annotated[
        bool, typer.Option("--headless", help="no dashboard: progress lines and a summary")
    ] = False,
    speed: Annotated[
        str, typer.Option(help="1, N times real time, or max [default: 1 on a screen, else max]")
    ] = "",
    seed: Annotated[int, typer.Option(min=0, help="the same seed gives the same run")] = 0,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission argument")
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE", help="e.g. controller.cruise_speed=0.4; see `parameters`"
        ),
    ] = None,
    robot: Annotated[str | None, typer.Option(help="another robot: a name or a robot.yaml")] = None,
    world: Annotated[str | None, typer.Option(help="another world: a name or a file")] = None,
    start: Annotated[
        str | None, typer.Option(metavar="X,Y,HEADING", help="another start: a pose or a place")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="the run's folder [default: runs/<mission>-<time>]")
    ] = None,
    no_rerun: Annotated[bool, typer.Option("--no-rerun", help="do not record mission.rrd")] = False,
    mavlink: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="send MAVLink, e.g. udpout:127.0.0.1:14550"),
    ] = None,
    camera: Annotated[Camera, typer.Option(help="render when asked, always, or never")] = (
        Camera.ASKED
    ),
    watch: Annotated[
        bool, typer.Option("--watch", help="take the mission anew whenever its file is saved")
    ] = False,
    break_: Annotated[
        list[str] | None,
        typer.Option(
            "--break", metavar="NODE", help="pause before a node: name, path or file:line"
        ),
    ] = None,
    force: Annotated[
        list[str] | None,
        typer.Option(metavar="NODE=OUTCOME", help="do not run a node: success or failure at once"),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="print the report as JSON, nothing else")] = (
        False
    ),
) -> None:
    """Run a mission: in the dashboard on a terminal, else with progress lines."""
    from missions.execution.supervisor import LaunchOptions, launch

    options = LaunchOptions(
        mission=mission, headless=headless or json or not _on_a_terminal(), json=json, seed=seed,
        speed=speed, arguments=assignments(set_ or []), robot=robot, world=world, start=start,
        out=out, rerun=not no_rerun, mavlink=mavlink, camera=camera.value, watch=watch,
        breakpoints=tuple(break_ or ()),
        forced=assignments(force or [], "--force", "dock=failure"),
        parameters=assignments(parameter or [], "--parameter"),
    )  # fmt: skip
    raise typer.Exit(launch(options))


@app.command()
def check(
    missions: Annotated[list[str], typer.Argument(help="mission or world files")],
    strict: Annotated[bool, typer.Option("--strict", help="warnings count as errors")] = False,
    install: Annotated[
        bool, typer.Option("--install", help="also check that no other package shadows ours")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="findings as JSON, for editors")] = False,
) -> None:
    """Report everything wrong with mission files, as file:line:column; nothing moves."""
    from missions.inspection.check import as_json, check_files, check_install

    findings = check_install() if install else []
    findings += check_files(missions)
    errors = sum(finding.is_error or strict for finding in findings)
    if json:
        typer.echo(as_json(findings))
        raise typer.Exit(2 if errors else 0)
    for finding in findings:
        typer.echo(finding.text, err=finding.is_error)
    typer.echo(f"{len(missions)} checked, {errors} with errors" if errors else "all good", err=True)
    raise typer.Exit(2 if errors else 0)


@app.command()
def explain(
    code: Annotated[str, typer.Argument(help="the code of a finding, e.g. E132")],
) -> None:
    """What a finding means: its cause, an example and the fix."""
    from missions.inspection.explain import explanation

    typer.echo(explanation(code))


@app.command()
def test(
    missions: Annotated[list[str], typer.Argument(help="mission files with `tests`")],
    keyword: Annotated[str, typer.Option("-k", help="only tests with this in their name")] = "",
    coverage: Annotated[
        bool, typer.Option("--coverage", help="list the nodes that no test ticks")
    ] = False,
) -> None:
    """Run the tests that missions carry: no simulator, behaviours replaced, a virtual clock."""
    from missions.testing.session import Wanted, run_files

    session = run_files(missions, Wanted(keyword, coverage))
    typer.echo(session.text)
    raise typer.Exit(session.exit_code)


@app.command()
def show(
    mission: MissionArgument,
    dot: Annotated[bool, typer.Option("--dot", help="as Graphviz")] = False,
    mermaid: Annotated[bool, typer.Option("--mermaid", help="as Mermaid")] = False,
    svg: Annotated[
        Path | None, typer.Option(metavar="FILE", help="into an SVG file; needs Graphviz")
    ] = None,
) -> None:
    """Draw the compiled tree: exactly what runs."""
    from missions.inspection.check import drawing

    if svg is not None:
        from missions.inspection.graphviz import save_svg

        save_svg(mission, str(svg))
        typer.echo(f"wrote {svg}", err=True)
        raise typer.Exit
    style = "dot" if dot else "mermaid" if mermaid else "text"
    typer.echo(
        drawing(mission, style, colours=sys.stdout.isatty() and "NO_COLOR" not in os.environ)
    )


@app.command("list")
def list_(
    kind: Annotated[Kind, typer.Argument(help="what to list")],
    mission: PluginsOf = None,
) -> None:
    """List what missions may name."""
    from missions.inspection.listing import installed, rows_of

    known = installed(mission)
    for problem in known.problems:
        typer.echo(f"cannot be used: {problem}", err=True)
    rows = rows_of(kind.value, known)
    width = max((len(name) for name, _ in rows), default=0)
    for name, sentence in rows:
        typer.echo(f"{name:<{width}}  {sentence}")


@app.command()
def describe(
    name: Annotated[str, typer.Argument(help="a behaviour, planner, controller, robot or world")],
    mission: PluginsOf = None,
) -> None:
    """Ports or parameters with type, unit, default, range and a sentence."""
    from missions.inspection.listing import description_of, installed

    known = installed(mission)
    for problem in known.problems:
        typer.echo(f"cannot be used: {problem}", err=True)
    typer.echo(description_of(name, known))


@app.command()
def parameters(
    mission: MissionArgument,
    robot: Annotated[str | None, typer.Option(help="another robot: a name or a robot.yaml")] = None,
    parameter: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="as `run` takes it")
    ] = None,
    changed: Annotated[bool, typer.Option("--set", help="only those that something sets")] = False,
) -> None:
    """Every parameter in force in a mission, and which file and line it comes from."""
    from missions.execution.prepare import RunOptions
    from missions.inspection.parameter_sources import lines_of, parameters_of

    found = parameters_of(
        mission,
        RunOptions(robot=robot, parameters=assignments(parameter or [], "--parameter")),
    )
    for line in lines_of([item for item in found if item.is_set or not changed]):
        typer.echo(line)


@app.command()
def schema(
    kind: Annotated[SchemaKind, typer.Argument(help="of which files")] = SchemaKind.MISSION,
    out: Annotated[Path | None, typer.Option(help="write it there [default: print it]")] = None,
    plugins: Annotated[
        list[str] | None, typer.Option(metavar="PLUGIN", help="as under `plugins` of a mission")
    ] = None,
) -> None:
    """JSON Schema of mission, world or robot files, for editors (docs/editors.md)."""
    from missions.editor.schemas import schema_text

    text = schema_text(kind.value, plugins or [])
    if out is None:
        typer.echo(text, nl=False)
    else:
        out.write_text(text, "utf-8")
        typer.echo(f"wrote {out}", err=True)


@app.command()
def nav2(
    file: Annotated[Path, typer.Argument(help="a nav2_params.yaml")],
    out: Annotated[
        Path | None, typer.Option(help="write what was taken over as a parameter file")
    ] = None,
) -> None:
    """What of a parameter file of Nav2 has an equivalent here, as what, and what has none.

    A mission uses such a file with `navigation: {nav2_params: FILE}`.
    """
    from missions.nav2.reading import read_nav2
    from missions.nav2.reporting import lines_of, parameter_file

    settings = read_nav2(file)
    for line in lines_of(settings):
        typer.echo(line)
    if out is not None:
        out.write_text(parameter_file(settings, file.name), "utf-8")
        typer.echo(f"wrote {out}", err=True)


@app.command()
def lsp() -> None:
    """A language server for mission files, on standard input and output (docs/editors.md)."""
    from missions.editor.serving import serve

    serve()


@app.command()
def trace(
    run: Annotated[Path, typer.Argument(help="a run's folder")],
    node: Annotated[
        str, typer.Option(help="only this node and below: name, kind, path, file:line")
    ] = "",
    since: Annotated[float, typer.Option(help="robot time, s")] = 0.0,
    until: Annotated[float, typer.Option(help="robot time, s")] = 1e18,
    summary: Annotated[bool, typer.Option("--summary", help="a line a node instead")] = False,
) -> None:
    """Tell a finished run's story node by node, and why a node was never reached."""
    from missions.inspection import trace as tracing

    told = tracing.read_trace(run)
    lines = tracing.summary(told, node) if summary else tracing.story(told, node, since, until)
    for line in lines:
        typer.echo(line)


@app.command()
def doctor(
    place: Annotated[str, typer.Argument(help="a world's name or file, or a ROS map.yaml")],
    robot: Annotated[str, typer.Option(help="whose footprint: a name or a robot.yaml")] = "scout",
    png: Annotated[Path | None, typer.Option(help="draw what was found")] = None,
) -> None:
    """Find doors and places that a robot's footprint closes; exit code 1 if there are any."""
    from missions.inspection.doctor import diagnose

    found = diagnose(place, robot, png)
    for line in found.lines:
        typer.echo(line)
    raise typer.Exit(1 if found.closed else 0)


@app.command()
def watch(
    run: Annotated[str, typer.Argument(help="a run's name or folder [default: the newest]")] = "",
) -> None:
    """Attach the dashboard to a running mission; closing it stops nothing."""
    from missions.execution.supervisor import watch_run

    if not _on_a_terminal():
        raise InputError("watch needs a terminal; without one read the run's events.jsonl")
    raise typer.Exit(watch_run(run))


app.add_typer(new_app, name="new")
app.add_typer(tell_app, name="tell")
app.add_typer(bench_app, name="bench")
app.command(epilog=TUNE_EPILOG)(tune)


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="print the version")] = False,
) -> None:
    if version:
        from importlib.metadata import version as installed

        typer.echo(f"treepilot {installed('treepilot')}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit


def _on_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def main() -> None:
    """The entry point: errors become sentences and exit codes."""
    try:
        app()
    except (InputError, ParameterError, TelemetryError) as error:
        typer.echo(str(error), err=True)
        raise SystemExit(2) from None
    except BodyError as error:
        typer.echo(f"the robot gave up: {error}", err=True)
        raise SystemExit(3) from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None
    except Exception:
        import traceback

        traceback.print_exc()
        typer.echo("internal error: this is a fault of treepilot, not of your mission", err=True)
        raise SystemExit(3) from None


if __name__ == "__main__":
    main()
