"""`treepilot schema`: the mission language on one page, also as a prompt."""

from typing import Annotated

import typer

from missions.cli.arguments import OtherRobot, PluginsOf


def schema(
    prompt: Annotated[
        bool, typer.Option("--prompt", help="as a prompt for a language model that writes missions")
    ] = False,
    robot: OtherRobot = None,
    world: Annotated[
        str | None, typer.Option("--world", help="describe another world: a name or a file")
    ] = None,
    mission: PluginsOf = None,
) -> None:
    """Print the mission language and what there is, on one page.

    Behaviours, a robot and a world.

    With --prompt also instructions, usual mistakes and examples. `treepilot check --json` answers
    to a draft.

    \b
    treepilot schema --prompt --robot scout --world office
    """
    from missions.inspection.drafting.prompt import page
    from missions.inspection.listing import installed

    typer.echo(page(installed(mission), robot, world, prompt=prompt))
