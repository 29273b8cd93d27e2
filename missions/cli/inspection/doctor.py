"""`treepilot doctor`: finds passages that a robot does not fit through, and lidars that see it."""

import sys
from pathlib import Path
from typing import Annotated

import typer


def doctor(
    place: Annotated[
        str,
        typer.Argument(help="name or file of a world or robot, or a ROS map: its YAML or image"),
    ],
    robot: Annotated[str, typer.Option(help="robot: a name or a robot.yaml")] = "scout",
    png: Annotated[Path | None, typer.Option(help="write a picture of the result")] = None,
) -> None:
    """Find doors and places that a robot does not fit through.

    Of a robot, find the beams of its lidars that see the robot. Exit code 1 if there are any.
    """
    from missions.inspection.doctor.lidars import diagnose_lidars, is_robot
    from missions.inspection.doctor.passages import examine

    if is_robot(place):
        found = diagnose_lidars(place)
    else:
        found = examine(place, robot, png, _show_progress)
    for line in found.lines:
        typer.echo(line)
    raise typer.Exit(1 if found.closed else 0)


def _show_progress(line: str) -> None:
    """Print what is being done, to people who wait for it."""
    if sys.stderr.isatty():
        typer.echo(line, err=True)
