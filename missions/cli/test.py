"""`treepilot test`: runs the tests in mission files without a simulator."""

from typing import Annotated

import typer

from missions.cli.arguments import Settings, assignments


def test(
    missions: Annotated[list[str], typer.Argument(help="mission files with a `tests` section")],
    keyword: Annotated[
        str, typer.Option("-k", help="run only tests whose name contains this text")
    ] = "",
    set_: Settings = None,
    coverage: Annotated[
        bool, typer.Option("--coverage", help="list the nodes that no test reaches")
    ] = False,
) -> None:
    """Run the tests inside mission files, without a simulator.

    Behaviours are replaced by mocks and time by a virtual clock.
    """
    from missions.testing.session import Options, run_files

    session = run_files(missions, Options(keyword, coverage, assignments(set_ or [])))
    typer.echo(session.text)
    raise typer.Exit(session.exit_code)
