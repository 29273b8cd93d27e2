"""`treepilot nav2`: shows what is imported from a Nav2 parameter file."""

from pathlib import Path
from typing import Annotated

import typer


def nav2(
    file: Annotated[Path, typer.Argument(help="Nav2 parameter file, e.g. nav2_params.yaml")],
    out: Annotated[
        Path | None, typer.Option(help="write the imported parameters to a file")
    ] = None,
    namespace: Annotated[
        str | None, typer.Option(help="namespace of the robot, in a file with several")
    ] = None,
) -> None:
    """Show which Nav2 parameters are imported and which are ignored.

    A mission imports such a file with `navigation: {nav2_params: FILE}`.
    """
    from missions.nav2.reading import read_nav2
    from missions.nav2.reporting import lines_of, parameter_file

    settings = read_nav2(file, namespace=namespace)
    for finding in settings.warnings:
        typer.echo(str(finding), err=True)
    for line in lines_of(settings):
        typer.echo(line)
    if out is not None:
        out.write_text(parameter_file(settings, file.name), "utf-8")
        typer.echo(f"wrote {out}", err=True)
