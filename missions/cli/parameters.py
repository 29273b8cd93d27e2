"""`treepilot parameters`: every parameter in force and its source."""

from __future__ import annotations

from typing import Annotated

import typer

from missions.cli.arguments import MissionArgument, assignments


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
