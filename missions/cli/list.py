"""`treepilot list` and `treepilot describe`: what missions can use."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from missions.cli.arguments import PluginsOf


class Kind(StrEnum):
    """What `treepilot list` lists."""

    BEHAVIOURS = "behaviours"
    ROBOTS = "robots"
    WORLDS = "worlds"
    MISSIONS = "missions"
    PLANNERS = "planners"
    CONTROLLERS = "controllers"
    LAYERS = "layers"


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
