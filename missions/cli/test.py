"""`treepilot test`: runs the tests in mission files without a simulator."""

from __future__ import annotations

from typing import Annotated

import typer


def test(
    missions: Annotated[list[str], typer.Argument(help="mission files with `tests`")],
    keyword: Annotated[str, typer.Option("-k", help="only tests with this in their name")] = "",
    coverage: Annotated[
        bool, typer.Option("--coverage", help="list the nodes that no test ticks")
    ] = False,
) -> None:
    """Run the tests that missions carry: no simulator, behaviours replaced, a virtual clock."""
    from missions.testing.session import Options, run_files

    session = run_files(missions, Options(keyword, coverage))
    typer.echo(session.text)
    raise typer.Exit(session.exit_code)
