"""What `treepilot calibrate` does with its results: options, and writing the robot file."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from missions.commissioning.robot_file import Values
    from stack.drivetrain.description import RobotDescription

OutOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="robot file to write [default: that of the robot]"),
]
DryRunOption = Annotated[bool, typer.Option("--dry-run", help="report, and write nothing")]


def write(robot: "RobotDescription", values: "Values", out: Path | None, *, dry_run: bool) -> None:
    """Write the calibrated values into the robot file, and print them.

    Raises:
        InputError: the new file would be refused.
    """
    from missions.commissioning.robot_file import is_shipped, write_values

    if not values:
        typer.echo("nothing is determined: the robot file stays as it is")
        return
    typer.echo("in the robot file:")
    for path, value in values.items():
        typer.echo(f"  {': '.join(path)}: {value}")
    if dry_run:
        return
    if out is None and is_shipped(robot):
        typer.echo(f"not written: {robot.name} is part of treepilot; use --out FILE")
        return
    typer.echo(f"wrote {write_values(robot, values, out)}")
