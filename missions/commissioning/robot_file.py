"""Writes calibrated values into a robot file, and leaves the rest of it as it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from robots.load import read_robot
from stack.documents.files import decoded, read_input
from stack.documents.rewriting import with_values
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.mapping.whole_files import replace_file

Values = Mapping[Sequence[str], str]
"""Values of a robot file as YAML, by path: ("wheels", "radius"): "7.5 cm"."""


def is_shipped(robot: RobotDescription) -> bool:
    """Whether a robot is part of treepilot; its file is not changed."""
    import robots

    source = robot.source
    folder = Path(robots.__file__).resolve().parent
    return source is not None and source.resolve().is_relative_to(folder)


def write_values(robot: RobotDescription, values: Values, out: Path | None = None) -> Path:
    """Write a robot file with other values; return its path.

    Args:
        robot: whose file is taken.
        values: to set.
        out: file to write; None: the robot's own.

    Raises:
        InputError: the robot has no file of its own, or the new one would be refused.
    """
    source = robot.source
    if source is None or (out is None and is_shipped(robot)):
        raise InputError(
            f"{robot.name} is a robot of treepilot, whose file is not changed",
            "write another one with --out FILE, or copy its folder",
        )
    target = out or source
    text = decoded(read_input(source, "robot file"), source)
    try:
        changed = with_values(text, values)
        read_robot(source, changed)
    except (InputError, ValueError) as error:
        raise InputError(f"the calibrated robot file would be refused: {error}") from None
    replace_file(target, changed.encode())
    return target
