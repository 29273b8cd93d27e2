"""`treepilot check` and `explain`: findings in mission and world files, and what they mean."""

from pathlib import Path
from typing import Annotated

import typer

from missions.cli.arguments import Settings, assignments, counted
from stack.errors import InputError


def check(
    missions: Annotated[list[str], typer.Argument(help="files: missions, worlds, robots, sweeps")],
    strict: Annotated[bool, typer.Option("--strict", help="treat warnings as errors")] = False,
    install: Annotated[
        bool,
        typer.Option(
            "--install", help="also check that no other package hides treepilot's modules"
        ),
    ] = False,
    set_: Settings = None,
    json: Annotated[bool, typer.Option("--json", help="print findings as JSON")] = False,
) -> None:
    """Check mission, world, robot and sweep files.

    Each finding has file:line:column, a code and a hint. Nothing moves. Exit code 2 on errors.
    """
    from missions.cli.sweep import check_sweep_file
    from missions.inspection.check import as_json, check_files, check_install, lines_of
    from missions.sweeps.sweep_file import is_sweep_file

    findings = check_install() if install else []
    sweeps = [name for name in missions if is_sweep_file(Path(name))]
    others = [name for name in missions if name not in sweeps]
    findings += check_files(others, assignments(set_ or []))
    for name in sweeps:
        try:
            check_sweep_file(Path(name))
        except InputError as error:
            findings += lines_of(name, error)
    errors = sum(finding.is_error or strict for finding in findings)
    if json:
        typer.echo(as_json(findings))
        raise typer.Exit(2 if errors else 0)
    for finding in findings:
        typer.echo(finding.text, err=finding.is_error)
    warnings = len(findings) - sum(finding.is_error for finding in findings)
    typer.echo(_summary(len(missions), errors, 0 if strict else warnings), err=True)
    raise typer.Exit(2 if errors else 0)


def _summary(files: int, errors: int, warnings: int) -> str:
    parts = [counted(files, "file") + " checked", counted(errors, "error")]
    if warnings:
        parts.append(counted(warnings, "warning"))
    return ", ".join(parts)


def explain(
    code: Annotated[str, typer.Argument(help="of a finding or a failure, e.g. E132, LOST")],
) -> None:
    """Explain the code of a finding or a failure, and the fix."""
    from missions.inspection.explain import explanation

    typer.echo(explanation(code))
