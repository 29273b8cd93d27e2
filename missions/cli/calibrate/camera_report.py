"""Printer of `treepilot calibrate camera`: the report, and the keys for a robot file."""

from collections.abc import Sequence
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING

from missions.cli.arguments import counted

if TYPE_CHECKING:
    from stack.perception.camera.board import Board
    from stack.perception.camera.calibration import Calibration

HEADER = "# treepilot calibrate camera"
"""Begin of a written file, by which it may be replaced."""

LITTLE_COVERAGE, LITTLE_REACH = 0.6, 0.85
"""Coverage and reach below which the distortion near the border is a guess."""

LARGE_ERROR, LARGE_RMS = 2.0, 1.0
"""View error as a share of the whole one, and pixels, from which on the report says so."""


def report(result: "Calibration", files: Sequence[Path]) -> list[str]:
    """Return the lines that describe a calibration from these pictures."""
    camera, spread = result.camera, result.deviations
    values = {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
    lines = ["", f"{counted(len(files), 'picture')}, reprojection error (RMS) {result.rms:.3f} px"]
    lines += [f"  {name}  {value:9.2f} ± {spread[name]:.2f} px" for name, value in values.items()]
    lines.append(
        "  (ROS and OpenCV count from the centre of the first pixel: "
        f"cx {camera.cx - 0.5:.2f}, cy {camera.cy - 0.5:.2f})"
    )
    lines += [
        f"  {name}  {value:+9.5f} ± {spread[name]:.5f}"
        for name, value in zip(("k1", "k2", "p1", "p2", "k3"), camera.distortion, strict=True)
    ]
    lines.append(f"  horizontal field of view {degrees(camera.horizontal_view):.1f} deg")
    lines.append(f"the board was tilted by up to {degrees(result.tilt):.0f} deg between pictures")
    lines.append(f"corners cover {100 * result.coverage:.0f} % of the picture:")
    lines += ["  " + " ".join(f"{count or '.':>3}" for count in row) for row in result.counts]
    lines.append("error of each picture:")
    lines += [
        f"  {error:6.3f} px  {file.name}"
        for file, error in zip(files, result.view_errors, strict=True)
    ]
    return [*lines, *(f"warning: {sentence}" for sentence in _warnings(result, files))]


def _warnings(result: "Calibration", files: Sequence[Path]) -> list[str]:
    from stack.perception.camera.calibration import ENOUGH_VIEWS

    found = []
    if len(files) < ENOUGH_VIEWS:
        found.append(f"few pictures: {len(files)}; {ENOUGH_VIEWS} to 20 give a better result")
    if result.coverage < LITTLE_COVERAGE or result.reach < LITTLE_REACH:
        found.append(
            f"the farthest corner is {100 * result.reach:.0f} % of the way from the middle to the "
            "corner of the picture; beyond, the distortion is a guess: take pictures with the "
            "board there"
        )
    if result.rms > LARGE_RMS:
        found.append(
            f"an error of {result.rms:.2f} px is large: is the board flat and as described, are "
            "the pictures sharp, were focus and zoom fixed?"
        )
    for file, error in zip(files, result.view_errors, strict=True):
        if error > LARGE_ERROR * result.rms:
            found.append(f"{file.name} fits worse than the others: is it blurred?")
    return found


def snippet(result: "Calibration", board: "Board", count: int) -> list[str]:
    """Return the keys for the camera in a robot file."""
    camera = result.camera
    distortion = ", ".join(f"{value:.6f}" for value in camera.distortion)
    return [
        f"{HEADER}: {counted(count, 'picture')}, RMS {result.rms:.3f} px",
        f"# {board.parameters}",
        "camera:",
        f"  width: {camera.width}",
        f"  height: {camera.height}",
        f"  focal_length: [{camera.fx:.3f}, {camera.fy:.3f}]      # fx, fy, px",
        f"  principal_point: [{camera.cx:.3f}, {camera.cy:.3f}]   # from the picture's corner, px",
        f"  distortion: [{distortion}]   # k1 k2 p1 p2 k3",
    ]
