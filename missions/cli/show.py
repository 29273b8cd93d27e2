"""`treepilot show`: draws the compiled tree."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import MissionArgument


def show(
    mission: MissionArgument,
    dot: Annotated[bool, typer.Option("--dot", help="print Graphviz source")] = False,
    mermaid: Annotated[bool, typer.Option("--mermaid", help="print Mermaid source")] = False,
    svg: Annotated[
        Path | None, typer.Option(metavar="FILE", help="write an SVG file; needs Graphviz")
    ] = None,
) -> None:
    """Draw the compiled behaviour tree of a mission."""
    from missions.inspection.check import drawing

    if svg is not None:
        from missions.inspection.graphviz import save_svg

        save_svg(mission, str(svg))
        typer.echo(f"wrote {svg}", err=True)
        raise typer.Exit
    style = "dot" if dot else "mermaid" if mermaid else "text"
    typer.echo(
        drawing(mission, style, colours=sys.stdout.isatty() and "NO_COLOR" not in os.environ)
    )
