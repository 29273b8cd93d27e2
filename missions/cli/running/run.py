"""`treepilot run`: runs a mission, in the dashboard or headless."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from missions.cli.arguments import (
    OtherRobot,
    Parameters,
    Settings,
    View,
    assignments,
    on_a_terminal,
)


class Record(StrEnum):
    """What can be recorded besides events; typer reads no list of `Literal`."""

    SENSORS = "sensors"


def run(  # noqa: PLR0913 - each is an option of the command
    missions: Annotated[
        list[str],
        typer.Argument(
            metavar="MISSION...",
            help="mission file, or the name of a shipped mission; several share one world",
        ),
    ],
    headless: Annotated[
        bool,
        typer.Option("--headless", help="print progress lines and a summary, open no dashboard"),
    ] = False,
    speed: Annotated[
        str,
        typer.Option(help="N times real time, or max [default: 1 in the dashboard, max headless]"),
    ] = "",
    seed: Annotated[
        int, typer.Option(min=0, help="random seed; the same seed gives the same run")
    ] = 0,
    set_: Settings = None,
    parameter: Parameters = None,
    robot: OtherRobot = None,
    world: Annotated[str | None, typer.Option(help="use another world: a name or a file")] = None,
    start: Annotated[
        str | None, typer.Option(metavar="X,Y,HEADING", help="start elsewhere: a pose or a place")
    ] = None,
    faults: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="faults of the simulated robot instead of the mission's: a file, or names joined"
            " by +, such as lidar_dropout+push; none; `treepilot list faults`",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="run folder [default: runs/<mission>-<time>]; for several missions, their parent"
        ),
    ] = None,
    view: View = False,
    mavlink: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="be a MAVLink rover for ground stations: udpout:127.0.0.1:14550 calls one",
        ),
    ] = None,
    mavlink_key: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="sign the MAVLink link and refuse unsigned commands; `treepilot keys mavlink`"
            " makes a key",
        ),
    ] = None,
    mavlink_home: Annotated[
        Literal["auto", "always", "never"],
        typer.Option(
            help="whether the first item of an uploaded plan is home: auto, if it is a waypoint of"
            " absolute altitude, as MAVProxy and QGroundControl write it"
        ),
    ] = "auto",
    origin: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON",
            help="where the map's origin is on Earth, degrees [default: the world file's]",
        ),
    ] = None,
    foxglove: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            min=1,
            max=65535,
            help="show the run live to the Foxglove app on this machine: ws://127.0.0.1:PORT;"
            " usual is 8765",
        ),
    ] = None,
    camera: Annotated[
        Literal["asked", "on", "off"], typer.Option(help="render on request, always or never")
    ] = "asked",
    renderer: Annotated[
        Literal["tiny", "gl", "auto"] | None,
        typer.Option(help="what draws camera pictures [default: that of the robot file]"),
    ] = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="reload the mission when its file changes")
    ] = False,
    break_: Annotated[
        list[str] | None,
        typer.Option(
            "--break",
            metavar="NODE",
            help="pause before a node starts: its name, path or file:line",
        ),
    ] = None,
    force: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NODE=OUTCOME",
            help="NODE=success or NODE=failure: do not run the node, return this",
        ),
    ] = None,
    record: Annotated[
        list[Record] | None,
        typer.Option(help="also record every measurement, to sensors.mcap in the run folder"),
    ] = None,
    replay: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="play a sensors.mcap instead of driving"),
    ] = None,
    body: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="what drives the robot: simulated, scripted, or a plugin's "
            "[default: the robot file's choice]",
            show_default=False,
        ),
    ] = "",
    on_lost_records: Annotated[
        Literal["continue", "stop"],
        typer.Option(
            help="when a record cannot be written, e.g. on a full disk: continue the mission, or"
            " stop it; the exit code is 3"
        ),
    ] = "continue",
    on_hangup: Annotated[
        Literal["continue", "stop", "abort"] | None,
        typer.Option(
            help="when the terminal is closed: continue the mission, stop the robot (pause), or"
            " abort [default: continue in a simulation, stop a real robot]"
        ),
    ] = None,
    hang_timeout: Annotated[
        float,
        typer.Option(
            min=0.0,
            metavar="SECONDS",
            help="end a run that makes no step for so long, e.g. in an endless loop; 0: never",
        ),
    ] = 60.0,
    skip_preflight: Annotated[
        bool,
        typer.Option(
            "--skip-preflight",
            help="start a real robot without the checks at standstill; an event records it",
        ),
    ] = False,
    forget_kept: Annotated[
        bool,
        typer.Option(
            "--forget-kept",
            help="start blackboard keys with `keep: true` from their initial values",
        ),
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="print only the report, as JSON")] = (False),
) -> None:
    """Run a mission, in the dashboard or headless.

    The dashboard opens on a terminal; elsewhere, and with --headless, progress lines are printed.

    Several missions run at once, a robot each, in one world with one clock. Their progress lines
    begin with the mission's name; open a dashboard for one with `treepilot watch`. The robots have
    the seeds SEED, SEED + 1, ... and run folders of their own.

    Ctrl+C (SIGINT) and SIGTERM end a run within 2 s, whatever a behaviour does; its report is
    written. Exit codes: 0 succeeded, 1 failed or aborted, 2 the input is wrong, 3 internal error,
    130 interrupted.
    """
    from missions.execution.supervision.launch import LaunchOptions, launch
    from missions.run_options import RunOptions

    without_dashboard = headless or json or len(missions) > 1 or not on_a_terminal()
    options = RunOptions(
        seed=seed, arguments=assignments(set_ or []), robot=robot, world=world, start=start,
        out=out, mavlink=mavlink, mavlink_key=mavlink_key, mavlink_home=mavlink_home,
        origin=origin, foxglove=foxglove, camera=camera, watch=watch,
        renderer=renderer or "",
        breakpoints=tuple(break_ or ()),
        forced=assignments(force or [], "--force", "dock=failure"),
        parameters=assignments(parameter or [], "--parameter"),
        body=body, replay=replay,
        record=tuple(item.value for item in record or ()),
        on_lost_records=on_lost_records, forget_kept=forget_kept,
        skip_preflight=skip_preflight, faults=faults,
    )  # fmt: skip
    launched = LaunchOptions(
        tuple(missions), options, headless=without_dashboard, json=json, speed=speed,
        on_hangup=on_hangup or "", hang_timeout=hang_timeout, view=view,
    )  # fmt: skip
    if foxglove is not None:
        typer.echo(f"in Foxglove: Open connection, ws://127.0.0.1:{foxglove}", err=True)
    raise typer.Exit(launch(launched))
