"""`treepilot nav2`: shows what is imported from a Nav2 parameter file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def nav2(
    file: Annotated[Path, typer.Argument(help="a nav2_params.yaml")],
    out: Annotated[
        Path | None, typer.Option(help="write what was taken over as a parameter file")
    ] = None,
) -> None:
    """What of a parameter file of Nav2 has an equivalent here, as what, and what has none.

    A mission uses such a file with `navigation: {nav2_params: FILE}`.
    """
    from missions.nav2.reading import read_nav2
    from missions.nav2.reporting import lines_of, parameter_file

    settings = read_nav2(file)
    for line in lines_of(settings):
        typer.echo(line)
    if out is not None:
        out.write_text(parameter_file(settings, file.name), "utf-8")
        typer.echo(f"wrote {out}", err=True)
