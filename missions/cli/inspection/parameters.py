"""`treepilot parameters`: every parameter in force and its source."""

from typing import Annotated

import typer

from missions.cli.arguments import MissionArgument, Settings, assignments


def parameters(
    mission: MissionArgument,
    robot: Annotated[
        str | None, typer.Option(help="use another robot: a name or a robot.yaml")
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="override a parameter, as in `treepilot run`"),
    ] = None,
    set_: Settings = None,
    changed: Annotated[
        bool, typer.Option("--changed", help="show only parameters that a file or option sets")
    ] = False,
) -> None:
    """Show the parameters of a mission and the file that sets each."""
    from missions.execution.prepare import RunOptions
    from missions.inspection.parameter_sources import lines_of, parameters_of

    found = parameters_of(
        mission,
        RunOptions(
            robot=robot,
            arguments=assignments(set_ or []),
            parameters=assignments(parameter or [], "--parameter"),
        ),
    )
    for line in lines_of([item for item in found if item.is_set or not changed]):
        typer.echo(line)
