"""`treepilot parameters`: every parameter in force and its source."""

from typing import Annotated

import typer

from missions.cli.arguments import (
    MissionArgument,
    OtherRobot,
    Parameters,
    Settings,
    assignments,
)


def parameters(  # noqa: PLR0913 - each is an option of the command
    mission: MissionArgument,
    wanted: Annotated[
        str,
        typer.Argument(
            metavar="[NAME]",
            help="show only this kind (`safety`) or names with this text (`speed`)",
        ),
    ] = "",
    robot: OtherRobot = None,
    parameter: Parameters = None,
    set_: Settings = None,
    changed: Annotated[
        bool, typer.Option("--changed", help="show only parameters that a file or option sets")
    ] = False,
    expert: Annotated[
        bool, typer.Option("--expert", help="show the parameters for experts too")
    ] = False,
) -> None:
    """Show the parameters of a mission and the file that sets each.

    Columns: name, value, source and meaning. `treepilot describe NAME` explains one parameter.
    Parameters for experts are shown if a file sets them, if NAME is the whole name of one, and with
    `--expert`.

    \b
    treepilot parameters 02_office_patrol safety
    treepilot parameters 02_office_patrol cruise_speed
    treepilot parameters 02_office_patrol --changed
    treepilot parameters 02_office_patrol safety --expert
    """
    from missions.execution.prepare import RunOptions
    from missions.inspection.parameter_sources import filtered, for_users, lines_of, parameters_of

    found = parameters_of(
        mission,
        RunOptions(
            robot=robot,
            arguments=assignments(set_ or []),
            parameters=assignments(parameter or [], "--parameter"),
        ),
    )
    found = [item for item in filtered(found, wanted) if item.is_set or not changed]
    shown = found if expert else for_users(found, wanted)
    for line in lines_of(shown):
        typer.echo(line)
    if len(shown) < len(found):
        typer.echo(f"{len(found) - len(shown)} more for experts: add --expert", err=True)
    if wanted and not found:
        typer.echo(f"no file or option sets a parameter of {wanted!r}", err=True)
