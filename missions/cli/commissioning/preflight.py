"""`treepilot preflight`: checks a robot before it drives."""

import json as json_text
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.commissioning.bodies import BodyOption, SeedOption, StartOption, WorldOption

if TYPE_CHECKING:
    from missions.commissioning.checks import Check, Preflight

SIGNS = {"passed": "✔", "failed": "✘", "skipped": "·"}

EPILOG = """
\b
  treepilot preflight ./my_rover                 all checks
  treepilot preflight ./my_rover patrol.yaml     with body, world and start of a mission
  treepilot preflight scout --json               for programs
"""


def preflight(  # noqa: PLR0913 - each is an option of the command
    robot: Annotated[str, typer.Argument(help="robot: a name or a robot.yaml")],
    mission: Annotated[
        str | None, typer.Argument(help="mission file, or the name of a shipped mission")
    ] = None,
    cameras: Annotated[bool, typer.Option("--cameras", help="check the cameras too")] = False,
    body: BodyOption = "",
    world: WorldOption = None,
    start: StartOption = None,
    seed: SeedOption = 0,
    json: Annotated[bool, typer.Option("--json", help="print the result as JSON")] = False,
) -> None:
    """Check the sensors, clocks and battery of a robot.

    Each line is a check: ✔ passed, ✘ failed, with the remedy below, or · not made. Exit code 1 if a
    check failed.
    """
    from missions.cli.commissioning.bodies import opened
    from missions.commissioning.checks import Preflight
    from missions.commissioning.preflight import preflight as checks_of

    with opened(robot, mission, body, world, start, seed) as opened_body:
        made = []
        for check in checks_of(opened_body, pictures=cameras):
            made.append(check)
            if not json:
                for line in lines_of(check):
                    typer.echo(line)
    result = Preflight(opened_body.description.name, tuple(made))
    if json:
        typer.echo(json_text.dumps(result.plain(), indent=2, ensure_ascii=False))
    else:
        typer.echo(summary_of(result))
    raise typer.Exit(1 if result.failures else 0)


def lines_of(check: "Check") -> list[str]:
    """Return the lines about a check."""
    lines = [f"{SIGNS[check.outcome]} {check.name}: {check.found}"]
    return [*lines, f"    {check.remedy}"] if check.remedy and check.outcome == "failed" else lines


def summary_of(result: "Preflight") -> str:
    """Return the last line."""
    made = [check for check in result.checks if check.outcome != "skipped"]
    wrong = len(result.failures)
    if not wrong:
        return f"{result.robot} is ready: {len(made)} checks passed"
    return f"{result.robot} is not ready: {wrong} of {len(made)} checks failed"
