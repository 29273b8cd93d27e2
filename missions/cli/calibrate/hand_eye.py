"""`treepilot calibrate hand-eye`: mount of a camera by the motions of an arm."""

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.calibrate.results import DryRunOption, OutOption, write
from stack.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.commissioning.hand_eye_views import FoundViews
    from missions.commissioning.robot_file import Values
    from stack.perception.hand_eye import HandEye
    from stack.types import CameraModel

EPILOG = """
\b
  treepilot calibrate hand-eye ./my_arm --from sensors.mcap --marker 7 --size "40 mm"

With a camera in the hand the marker lies still in view; with a camera on a mast the hand holds the
marker. Move the arm to 15 or more poses, tilted by 20 to 40 deg to different sides, and let it
stand for half a second at each. Record it with `treepilot run … --record sensors --camera on`.
Calibrate the lens first: `treepilot calibrate camera`.
"""


def hand_eye(  # noqa: PLR0913 - options
    robot: Annotated[str, typer.Argument(help="robot: a name or a robot.yaml")],
    from_: Annotated[
        Path, typer.Option("--from", metavar="FILE", help="recorded motions, sensors.mcap")
    ],
    marker: Annotated[int, typer.Option(min=0, metavar="ID", help="number of the marker")],
    size: Annotated[str, typer.Option(metavar="LENGTH", help="side of its black square")],
    dictionary: Annotated[
        str, typer.Option(metavar="NAME", help="dictionary of the marker")
    ] = "DICT_4X4_50",
    out: OutOption = None,
    dry_run: DryRunOption = False,
) -> None:
    """Calibrate the mount of the camera of an arm from views of a marker.

    Position and direction of the camera are written into the robot file: in the frame of its link
    for a camera in the hand, else in the base frame. Exit code 1 if views do not fit to the others.
    """
    from missions.commissioning.hand_eye_views import mounted, views_in
    from missions.execution.resources import load_robot
    from stack.perception.hand_eye import calibrate_hand_eye
    from stack.telemetry.sensor_log import read_observations

    described = load_robot(robot, Path.cwd())
    side = _side(size)
    found = views_in(read_observations(from_), described, marker, side, dictionary)
    camera = described.camera
    assert camera is not None  # else there are no views
    result = calibrate_hand_eye(found.views, in_hand=bool(camera.link))
    model = mounted(camera.model, result)
    for line in report(found, result, camera.model, model):
        typer.echo(line)
    write(described, mount_values(model), out, dry_run=dry_run)
    raise typer.Exit(1 if result.doubtful else 0)


def _side(text: str) -> float:
    from stack.errors import ParameterError
    from stack.parameters import read_quantity

    try:
        side = read_quantity(text, "m")
    except ParameterError as error:
        raise InputError(f"--size {text}: {error.sentence}") from None
    if not side > 0.0:
        raise InputError(f"--size {text}: expected more than 0 m, such as 40 mm")
    return side


def mount_values(camera: "CameraModel") -> "Values":
    """Return the keys of a robot file for the mount of its camera."""
    x, y, z = camera.position
    values: dict[Sequence[str], str] = {("camera", "position"): f"[{x:.4f}, {y:.4f}, {z:.4f}]"}
    for name, angle in (("yaw", camera.yaw), ("pitch", camera.pitch), ("roll", camera.roll)):
        values["camera", name] = f"{degrees(angle):.2f} deg"
    return values


def report(
    found: "FoundViews", result: "HandEye", before: "CameraModel", after: "CameraModel"
) -> list[str]:
    """Return the lines about views, mount and residuals."""
    from stack.perception.hand_eye import ENOUGH_VIEWS

    lines = [f"{len(found.views)} views of different poses of the arm"]
    for count, words in (
        (found.moving, "pictures not used: the arm moved"),
        (found.unclear, "pictures not used: the marker may be tilted to either side"),
    ):
        lines += [f"{count} {words}"] if count else []
    if len(found.views) < ENOUGH_VIEWS:
        lines.append(f"{ENOUGH_VIEWS} views or more are better")
    move, turn = result.rms
    lines += [*_mount_lines(before, after), _deviation_line(result)]
    lines.append(f"residual of a view (RMS): {1000.0 * move:.1f} mm, {degrees(turn):.2f} deg")
    for number in result.doubtful:
        lines.append(
            f"✘ the view at {found.stamps[number]:.1f} s does not fit to the others: "
            f"{1000.0 * result.moves[number]:.1f} mm, {degrees(result.turns[number]):.2f} deg; did "
            "the marker slip?"
        )
    return lines


def _mount_lines(before: "CameraModel", after: "CameraModel") -> list[str]:
    lines = [f"{'':10}{'robot file':>14}{'fitted':>14}"]
    for name, old, new in zip("xyz", before.position, after.position, strict=True):
        lines.append(f"  {name:8}{100.0 * old:10.2f} cm {100.0 * new:10.2f} cm")
    for name, old, new in (
        ("yaw", before.yaw, after.yaw), ("pitch", before.pitch, after.pitch),
        ("roll", before.roll, after.roll),
    ):  # fmt: skip
        lines.append(f"  {name:8}{degrees(old):10.2f} deg{degrees(new):10.2f} deg")
    return lines


def _deviation_line(result: "HandEye") -> str:
    move = 1000.0 * float((result.deviations[:3] ** 2).sum()) ** 0.5
    turn = degrees(float((result.deviations[3:] ** 2).sum()) ** 0.5)
    return f"standard deviation of the mount: {move:.1f} mm, {turn:.2f} deg"
