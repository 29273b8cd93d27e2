"""`treepilot list` and `treepilot describe`: what missions can use."""

from typing import Annotated, Literal, get_args

import typer

from missions.cli.arguments import PluginsOf

Kind = Literal[
    "behaviours", "nodes", "modifiers", "robots", "worlds", "missions", "planners", "controllers",
    "goal_checkers", "progress_checkers", "estimators", "odometry", "layers", "faults",
]  # fmt: skip


def list_(
    kind: Annotated[
        Kind, typer.Argument(metavar="KIND", help=f"one of: {', '.join(get_args(Kind))}")
    ],
    mission: PluginsOf = None,
) -> None:
    """List behaviours, nodes, robots, worlds, components or faults.

    \b
    treepilot list behaviours
    treepilot list worlds
    """
    from missions.inspection.listing import installed, rows_of
    from stack.columns import columns

    known = installed(mission)
    for problem in known.problems:
        typer.echo(f"not available: {problem}", err=True)
    for line in columns(rows_of(kind, known)):
        typer.echo(line)


def describe(
    name: Annotated[
        str,
        typer.Argument(
            help="name of a behaviour, node, modifier, component, robot, world or mission; or "
            "KIND.PARAMETER; or the file of a robot, world, map, mission or trees"
        ),
    ],
    mission: PluginsOf = None,
    expert: Annotated[
        bool, typer.Option("--expert", help="list the parameters for experts too")
    ] = False,
) -> None:
    """Describe a behaviour, component, robot, world, map or mission.

    \b
    treepilot describe navigate_to_pose
    treepilot describe pure_pursuit
    treepilot describe safety
    treepilot describe safety.padding_speed
    treepilot describe ./my_robot/robot.yaml
    """
    from missions.inspection.listing import description_of, installed

    known = installed(mission)
    for problem in known.problems:
        typer.echo(f"not available: {problem}", err=True)
    typer.echo(description_of(name, known, expert=expert))
