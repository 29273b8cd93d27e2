"""`treepilot doctor ROBOT`: the beams of its lidars that see the robot itself."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from missions.execution.resources import load_robot
from missions.inspection.diagnosis import FileKind, kind_of
from missions.inspection.doctor.passages import Examination, counted
from robots.load import robot_names
from stack.drivetrain.description import LidarDescription, RobotDescription
from stack.perception.own_body import OwnBody
from stack.sim.physics.default import DEFAULT_ENGINE
from stack.types import FloatArray, Observation, Scan

EDGE = 0.5
"""Degrees that a proposed mask is wider on both sides than the beams that see the robot, at least;
one beam more where beams are further apart."""


def is_robot(name: str) -> bool:
    """Return whether a name or file is that of a robot."""
    if name in robot_names():
        return True
    path = Path(name) / "robot.yaml" if Path(name).is_dir() else Path(name)
    return path.is_file() and kind_of(path) is FileKind.ROBOT


def diagnose_lidars(name: str) -> Examination:
    """Find the beams of a robot's lidars that see the robot, by the shapes of its URDF.

    Args:
        name: name or file of the robot.

    Raises:
        InputError: it cannot be read.
    """
    robot = load_robot(name, Path.cwd())
    lines: list[str] = []
    wanting = 0
    for sensor, lidar in robot.real_lidars.items():
        found, is_wanting = _lidar_lines(robot, sensor, lidar)
        lines += found
        wanting += is_wanting
    if not lines:
        lines = [f"{robot.name} has no lidar"]
    return Examination((*lines,), wanting)


def _lidar_lines(
    robot: RobotDescription, name: str, lidar: LidarDescription
) -> tuple[list[str], bool]:
    """Return the lines about a lidar, and whether it needs a mask that it lacks."""
    ranges = DEFAULT_ENGINE.own_ranges(robot.model, lidar)
    seen = np.isfinite(ranges) & (ranges >= lidar.range_min)
    left = seen & np.isfinite(_after_removal(robot, name, lidar, ranges))
    lines = [_sight_line(name, lidar, ranges, run, left) for run in _runs(seen)]
    if not lines:
        return [f"✔ {name}: no beam sees the robot's own shapes at {lidar.height:g} m"], False
    if not left.any():
        return lines, False
    masks = [_limits(lidar, run) for run in _runs(left)]
    section = "lidar" if name == "lidar" else f"lidars: {name}"
    listed = ", ".join(f"[{first:.1f} deg, {last:.1f} deg]" for first, last in masks)
    lines.append(f"  add to `{section}` in robot.yaml, with masks that are already there:")
    lines.append(f"  mask: [{listed}]")
    return lines, True


def _after_removal(
    robot: RobotDescription, name: str, lidar: LidarDescription, ranges: FloatArray
) -> FloatArray:
    """Return the ranges (beams,) without those that the stack takes for the robot."""
    scan = Scan(
        0.0, ranges.astype(np.float32), lidar.angle_min, lidar.angle_increment,
        lidar.range_min, lidar.range_max, lidar.mount,
    )  # fmt: skip
    after = OwnBody(robot).removed(Observation(0.0, {name: scan})).measurements[name]
    assert isinstance(after, Scan)
    return after.ranges.astype(np.float64)


def _sight_line(
    name: str,
    lidar: LidarDescription,
    ranges: FloatArray,
    run: range,
    left: NDArray[np.bool_],
) -> str:
    first, last = (degrees(lidar.angles[beam % lidar.beams]) for beam in (run[0], run[-1]))
    beams = [beam % lidar.beams for beam in run]
    near = ranges[beams].min()
    where = f"{name}: {counted(len(run), 'beam')} from {first:.1f} to {last:.1f} deg"
    sight = f"{where} see the robot itself at {near:.2f} m"
    if left[beams].any():
        return f"✘ {sight}, outside its footprint: obstacles, without a mask"
    return f"✔ {sight}: not used"


def _limits(lidar: LidarDescription, run: range) -> tuple[float, float]:
    """Return the first and last direction of a mask over beams, degrees, as in robot.yaml."""
    edge = max(EDGE, degrees(lidar.angle_increment))
    first, last = (degrees(lidar.angles[beam % lidar.beams]) for beam in (run[0], run[-1]))
    limits = first - edge, last + edge
    return (-limits[1], -limits[0]) if lidar.upside_down else limits


def _runs(seen: NDArray[np.bool_]) -> Iterator[range]:
    """Yield the runs of True, joined across the end; beams beyond the end begin again at 0."""
    if seen.all():
        yield range(len(seen))
        return
    start = 0 if not len(seen) else int(np.flatnonzero(~seen)[0])
    begin: int | None = None
    for beam in range(start, start + len(seen) + 1):
        if seen[beam % len(seen)] and beam < start + len(seen):
            begin = beam if begin is None else begin
        elif begin is not None:
            yield range(begin, beam)
            begin = None
