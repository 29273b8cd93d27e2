"""`treepilot demo`: a patrol to disturb, in the dashboard."""

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.arguments import on_a_terminal
from stack.errors import InputError

if TYPE_CHECKING:
    from missions.execution.supervision.live_recording import LiveRecording

MISSION = "02_office_patrol"


def demo(
    seed: Annotated[int, typer.Option(min=0, help="random seed")] = 7,
    out: Annotated[
        Path | None, typer.Option(help="run folder [default: runs/<mission>-<time>]")
    ] = None,
    view: Annotated[
        bool, typer.Option("--view", help="open rerun's viewer beside it; without a display: web")
    ] = False,
) -> None:
    """Watch a robot patrol an office, and disturb it.

    In the dashboard, B drops a box before the robot, O closes or opens the nearest door, L lifts
    the robot to a place on the map, and D lists what else can be done: push it, take a sensor away,
    drain the battery. The line at the top says what the robot does about it. `?` lists all keys,
    q leaves, space is the emergency stop.

    The mission is missions/02_office_patrol.yaml; `treepilot run 02_office_patrol` runs it without
    these hints. Afterwards `treepilot replay` shows the run again.
    """
    from missions.execution.records.run_folders import RUNS, reserved_suffix
    from missions.execution.supervision.launch import LaunchOptions, launch
    from missions.run_options import RunOptions

    if not on_a_terminal():
        raise InputError(
            f"demo needs a terminal; without one: treepilot run {MISSION} --headless --seed {seed}"
        )
    with ExitStack() as opened:
        if view:
            suffix = "" if out else opened.enter_context(reserved_suffix([MISSION]))
            out = out or RUNS / f"{MISSION}{suffix}"
            opened.callback(_open_viewer(out / "mission.rrd").close)
        options = RunOptions(seed=seed, out=out, rerun=view)
        raise typer.Exit(launch(LaunchOptions((MISSION,), options, headless=False, is_demo=True)))


def _open_viewer(recording: Path) -> "LiveRecording":
    import os
    import sys

    from missions.execution.supervision.live_recording import LiveRecording
    from missions.inspection.run_folders import WEB_ADDRESS, without_display

    web = bool(without_display(recording, os.environ, sys.platform))
    if web:
        typer.echo(f"open {WEB_ADDRESS}")
    return LiveRecording(recording, ["--serve-web"] if web else [])
