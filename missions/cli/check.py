"""`treepilot check`: reports every finding in mission and world files."""

from __future__ import annotations

from typing import Annotated

import typer


def check(
    missions: Annotated[list[str], typer.Argument(help="mission or world files")],
    strict: Annotated[bool, typer.Option("--strict", help="warnings count as errors")] = False,
    install: Annotated[
        bool, typer.Option("--install", help="also check that no other package shadows ours")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="findings as JSON, for editors")] = False,
) -> None:
    """Report everything wrong with mission files, as file:line:column; nothing moves."""
    from missions.inspection.check import as_json, check_files, check_install

    findings = check_install() if install else []
    findings += check_files(missions)
    errors = sum(finding.is_error or strict for finding in findings)
    if json:
        typer.echo(as_json(findings))
        raise typer.Exit(2 if errors else 0)
    for finding in findings:
        typer.echo(finding.text, err=finding.is_error)
    typer.echo(f"{len(missions)} checked, {errors} with errors" if errors else "all good", err=True)
    raise typer.Exit(2 if errors else 0)
