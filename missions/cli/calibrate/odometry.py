"""`treepilot calibrate odometry`: wheel radii, track and gyro from a drive."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.calibrate.odometry_report import progress, report
from missions.cli.calibrate.results import DryRunOption, OutOption, write
from missions.cli.commissioning.bodies import BodyOption, SeedOption, StartOption, WorldOption
from stack.errors import InputError

if TYPE_CHECKING:
    from missions.commissioning.odometry_fit import OdometryFit
    from stack.drivetrain.description import RobotDescription

EPILOG = """
\b
  treepilot calibrate odometry ./my_rover                     drives, then writes the robot file
  treepilot calibrate odometry ./my_rover --dry-run           drives, and only reports
  treepilot calibrate odometry ./my_rover --from sensors.mcap a recorded drive
  treepilot run patrol.yaml --record sensors                  records one

The robot stands in the middle of a free area: at least 1 m more on each side than it is long, with
walls or furniture in the range of its lidar. It drives squares both ways and turns in place, a car
circles to both sides, until all lengths are known to the precision. The lidar is the reference.
"""


def odometry(  # noqa: PLR0913 - each is an option of the command
    robot: Annotated[str, typer.Argument(help="robot: a name or a robot.yaml")],
    from_: Annotated[
        Path | None,
        typer.Option("--from", metavar="FILE", help="read a recorded drive, sensors.mcap"),
    ] = None,
    precision: Annotated[
        str, typer.Option(metavar="PERCENT", help="standard deviation of the lengths to drive for")
    ] = "0.3 %",
    time: Annotated[str, typer.Option(metavar="TIME", help="longest drive")] = "15 min",
    lidar: Annotated[
        str,
        typer.Option(metavar="NAME", help="lidar that is the reference [default: main]"),
    ] = "",
    body: BodyOption = "",
    world: WorldOption = None,
    start: StartOption = None,
    seed: SeedOption = 0,
    out: OutOption = None,
    dry_run: DryRunOption = False,
) -> None:
    """Calibrate wheel radii, track and gyro by driving.

    What the drive does not determine is not written, and the report says what to drive for it. Exit
    code 1 if a length is not determined.
    """
    from missions.execution.resources import load_robot

    if from_ is not None:
        described = load_robot(robot, Path.cwd())
        fit = _recorded(from_, described, lidar)
    else:
        described, fit = _driven(
            robot, (body, world, start, seed), lidar, _share(precision), _seconds(time)
        )
    for line in report(described, fit):
        typer.echo(line)
    write(described, fit.values, out, dry_run=dry_run)
    raise typer.Exit(0 if all(estimate.is_determined for estimate in fit.estimates) else 1)


def _recorded(log: Path, robot: "RobotDescription", lidar: str) -> "OdometryFit":
    from missions.commissioning.odometry import fit_recorded
    from stack.telemetry.sensor_log import read_observations

    return fit_recorded(read_observations(log), robot, lidar)


def _driven(
    robot: str,
    chosen: tuple[str, str | None, str | None, int],
    lidar: str,
    precision: float,
    longest: float,
) -> "tuple[RobotDescription, OdometryFit]":
    from missions.cli.commissioning.bodies import opened
    from missions.commissioning.odometry import DriveLimits, drive_and_fit, prepared

    with opened(robot, None, *chosen) as body:
        driver, pattern = prepared(body, lidar)
        fit = drive_and_fit(
            driver, pattern, DriveLimits(precision, longest),
            lambda state: typer.echo(progress(state), err=True),
        )  # fmt: skip
        return body.description, fit


def _share(text: str) -> float:
    from stack.errors import ParameterError
    from stack.parameters import read_quantity

    try:
        share = read_quantity(text, "")
    except ParameterError as error:
        raise InputError(f"--precision {text}: {error.sentence}") from None
    if not 0.0005 <= share <= 0.05:
        raise InputError(f"--precision {text}: expected 0.05 % to 5 %")
    return share


def _seconds(text: str) -> float:
    from stack.errors import ParameterError
    from stack.parameters import read_quantity

    try:
        return read_quantity(text, "s")
    except ParameterError as error:
        raise InputError(f"--time {text}: {error.sentence}") from None
