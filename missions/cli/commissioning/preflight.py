"""`treepilot preflight`: checks a robot before it drives."""

import json as json_text
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.commissioning.bodies import BodyOption, SeedOption, StartOption, WorldOption

if TYPE_CHECKING:
    from missions.commissioning.checks import Check, Preflight

SIGNS = {"passed": "✔", "failed": "✘", "skipped": "·"}

EPILOG = """
\b
  treepilot preflight ./my_rover                 all checks; asks before the robot moves
  treepilot preflight ./my_rover --no-motion     only those for which it stands
  treepilot preflight ./my_rover --estop         also that of the emergency stop
  treepilot preflight ./my_rover patrol.yaml     with body, world and start of a mission
  treepilot preflight scout --json               for programs
"""


def preflight(  # noqa: PLR0913 - each is an option of the command
    robot: Annotated[str, typer.Argument(help="robot: a name or a robot.yaml")],
    mission: Annotated[
        str | None, typer.Argument(help="mission file, or the name of a shipped mission")
    ] = None,
    no_motion: Annotated[
        bool, typer.Option("--no-motion", help="leave out the checks in which the robot moves")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="move without asking")] = False,
    estop: Annotated[
        bool, typer.Option("--estop", help="test the emergency stop: press it when asked")
    ] = False,
    cameras: Annotated[bool, typer.Option("--cameras", help="check the cameras too")] = False,
    body: BodyOption = "",
    world: WorldOption = None,
    start: StartOption = None,
    seed: SeedOption = 0,
    json: Annotated[bool, typer.Option("--json", help="print the result as JSON")] = False,
) -> None:
    """Check sensors, clocks, mounts and stops of a robot.

    Each line is a check: ✔ passed, ✘ failed, with the remedy below, or · not made. Exit code 1 if a
    check failed.
    """
    from missions.cli.commissioning.bodies import opened
    from missions.commissioning.checks import Preflight
    from missions.commissioning.preflight import preflight as checks_of

    with opened(robot, mission, body, world, start, seed) as opened_body:
        made = []
        asked = None if no_motion else _confirmation(yes=yes, json=json)
        for check in checks_of(opened_body, asked, pictures=cameras, estop=estop):
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


def _confirmation(*, yes: bool, json: bool) -> Callable[[str], bool]:
    """Return how the operator is asked; without a terminal only --yes confirms."""
    import sys

    if yes:
        return lambda _: True
    if json or not sys.stdin.isatty():
        return lambda _: False
    return lambda question: typer.confirm(question, err=True)


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
