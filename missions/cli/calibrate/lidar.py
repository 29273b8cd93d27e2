"""`treepilot calibrate lidar`: mounts of lidars from a drive."""

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.calibrate.results import DryRunOption, OutOption, write
from missions.cli.commissioning.bodies import BodyOption, SeedOption, StartOption, WorldOption
from stack.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.commissioning.lidar_fit import MountFit
    from stack.drivetrain.description import RobotDescription
    from stack.types import Observation

EPILOG = """
\b
  treepilot calibrate lidar ./my_rover                         each lidar, by driving
  treepilot calibrate lidar ./my_rover --lidar rear --dry-run  one of them, and only report
  treepilot calibrate lidar ./my_rover --from sensors.mcap     a recorded drive

Calibrate the odometry first: wheels and gyro are the reference. The robot drives as for `calibrate
odometry` and needs the same space. Straight drives determine the yaw, turns the position. Height,
roll and pitch do not show in a drive on a level floor: measure them.
"""


def lidar(  # noqa: PLR0913 - each is an option of the command
    robot: Annotated[str, typer.Argument(help="robot: a name or a robot.yaml")],
    from_: Annotated[
        Path | None,
        typer.Option("--from", metavar="FILE", help="read a recorded drive, sensors.mcap"),
    ] = None,
    lidar: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="lidar to calibrate; repeatable [default: all]"),
    ] = None,
    rounds: Annotated[int, typer.Option(min=1, max=20, help="rounds to drive")] = 2,
    body: BodyOption = "",
    world: WorldOption = None,
    start: StartOption = None,
    seed: SeedOption = 0,
    out: OutOption = None,
    dry_run: DryRunOption = False,
) -> None:
    """Calibrate position and yaw of lidars by driving.

    What the drive does not determine is not written, and the report says what to drive for it. Exit
    code 1 if something is not determined.
    """
    from missions.commissioning.lidar_fit import fit_mount
    from missions.execution.resources import load_robot

    described = load_robot(robot, Path.cwd())
    names = lidar or list(described.real_lidars)
    for name in names:
        if name not in described.real_lidars:
            known = ", ".join(described.real_lidars) or "none"
            raise InputError(f"--lidar {name}: {described.name} has no such lidar; it has {known}")
    if not names:
        raise InputError(f"{described.name} has no lidar")
    if from_ is not None:
        from stack.telemetry.sensor_log import read_observations

        seen: Sequence[Observation] = list(read_observations(from_))
    else:
        described, seen = _driven(robot, (body, world, start, seed), rounds)
    fits = [fit_mount(seen, described, name) for name in names]
    for fit in fits:
        for line in report(fit):
            typer.echo(line)
    values = {path: value for fit in fits for path, value in fit.values.items()}
    write(described, values, out, dry_run=dry_run)
    raise typer.Exit(1 if any(fit.missing for fit in fits) else 0)


def _driven(
    robot: str, chosen: tuple[str, str | None, str | None, int], count: int
) -> "tuple[RobotDescription, Sequence[Observation]]":
    from missions.cli.commissioning.bodies import opened
    from missions.commissioning.odometry import prepared
    from missions.commissioning.programme import rounds

    with opened(robot, None, *chosen) as body:
        driver, pattern = prepared(body)
        for number, _ in enumerate(rounds(driver, pattern), 1):
            driver.reference.keep_map()
            typer.echo(f"round {number} of {count}, {body.time:.0f} s", err=True)
            if number >= count:
                break
        return body.description, driver.observations


def report(fit: "MountFit") -> list[str]:
    """Return the lines about a lidar."""
    before, mount = fit.before, fit.mount
    x, y, yaw = fit.deviations.tolist()
    lines = [f"{fit.lidar}: {fit.segments} segments", f"{'':10}{'robot file':>14}{'fitted':>14}"]
    for name, old, new, deviation, factor, unit in (
        ("x", before.x, mount.x, x, 100.0, "cm"),
        ("y", before.y, mount.y, y, 100.0, "cm"),
        ("yaw", before.heading, mount.heading, yaw, degrees(1.0), "deg"),
    ):
        numbers = f"{factor * old:10.2f} {unit:3}{factor * new:10.2f} {unit:3}"
        lines.append(f"  {name:8}{numbers}   ± {factor * deviation:.2f}")
    was, now = (1000.0 * value for value in fit.residuals)
    lines.append(f"  residual of a segment (RMS): {was:.1f} mm before, {now:.1f} mm after")
    return [*lines, *(f"  ✘ not determined: {missing}" for missing in fit.missing)]
