"""`treepilot demo`: a patrol to disturb, in the dashboard."""

from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import View, on_a_terminal
from stack.errors import InputError

MISSION = "02_office_patrol"


def demo(
    seed: Annotated[int, typer.Option(min=0, help="random seed")] = 7,
    out: Annotated[
        Path | None, typer.Option(help="run folder [default: runs/<mission>-<time>]")
    ] = None,
    view: View = False,
) -> None:
    """Watch a robot patrol an office, and disturb it.

    In the dashboard, B drops a box before the robot, O closes or opens the nearest door, L lifts
    the robot to a place on the map, and D lists what else can be done: push it, take a sensor away,
    drain the battery. The line at the top says what the robot does about it. `?` lists all keys,
    q leaves, space is the emergency stop.

    The mission is missions/02_office_patrol.yaml; `treepilot run 02_office_patrol` runs it without
    these hints. Afterwards `treepilot replay` shows the run again.
    """
    from missions.execution.supervision.launch import LaunchOptions, launch
    from missions.run_options import RunOptions

    if not on_a_terminal():
        raise InputError(
            f"demo needs a terminal; without one: treepilot run {MISSION} --headless --seed {seed}"
        )
    options = RunOptions(seed=seed, out=out)
    launched = LaunchOptions((MISSION,), options, headless=False, view=view, is_demo=True)
    raise typer.Exit(launch(launched))
