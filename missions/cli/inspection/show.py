"""`treepilot show`: draws the compiled tree of a mission, or a world."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import Settings, assignments
from stack.errors import InputError


def show(  # noqa: PLR0913 - each is an option of the command
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="MISSION | world WORLD",
            help="mission, or the word `world` and a world or ROS map: names or files",
        ),
    ],
    dot: Annotated[bool, typer.Option("--dot", help="print Graphviz source")] = False,
    mermaid: Annotated[bool, typer.Option("--mermaid", help="print Mermaid source")] = False,
    svg: Annotated[
        Path | None, typer.Option(metavar="FILE", help="write an SVG file; needs Graphviz")
    ] = None,
    png: Annotated[
        Path | None, typer.Option(metavar="FILE", help="write a picture of a world")
    ] = None,
    set_: Settings = None,
) -> None:
    """Draw the behaviour tree of a mission, or the map of a world.

    \b
    treepilot show 02_office_patrol
    treepilot show world office --png office.png
    """
    if what[0] == "world" and len(what) > 1:
        _world(what[1:], png)
        return
    if len(what) > 1:
        raise InputError(f"show draws one mission, got {' '.join(what)}; for a world: show world W")
    if png is not None:
        raise InputError("--png draws worlds: show world WORLD --png FILE; see also --svg")
    from missions.inspection.check import drawing

    mission, arguments = what[0], assignments(set_ or [])
    if svg is not None:
        from missions.inspection.graphviz import save_svg

        save_svg(mission, str(svg), arguments)
        typer.echo(f"wrote {svg}", err=True)
        raise typer.Exit
    style = "dot" if dot else "mermaid" if mermaid else "text"
    colours = sys.stdout.isatty() and "NO_COLOR" not in os.environ
    typer.echo(drawing(mission, style, colours=colours, arguments=arguments))


def _world(names: list[str], png: Path | None) -> None:
    if len(names) > 1:
        raise InputError(f"show draws one world, got {' '.join(names)}")
    if png is None:
        raise InputError(f"show world {names[0]} needs --png FILE; `describe` prints its content")
    from missions.inspection.doctor.passages import show_world

    typer.echo(show_world(names[0], png), err=True)
