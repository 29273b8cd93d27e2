"""Poses and paths, as files write them: `[x, y, heading]` and lists of those."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any

import numpy as np

from stack.errors import Hint, ParameterError
from stack.parameters.names import write
from stack.parameters.quantities import read_number, shown
from stack.types import Path, Pose2D, wrap_angle

FARTHEST = 1e6
"""Metres: largest coordinate of a pose."""
_HEADINGS = ("heading", "theta", "yaw", "angle")


def read_pose(raw: Any) -> Pose2D:
    """Convert `[x, y]` or `[x, y, heading]` of a file.

    Raises:
        ParameterError: it is no pose; quotes the value, with what to write instead.
    """
    if not isinstance(raw, list | tuple):
        sentence = f"expected a pose [x, y, heading], got {shown(raw)}"
        raise ParameterError("", sentence, _hint(raw))
    if len(raw) not in (2, 3):
        whole = all(isinstance(item, int) for item in raw)
        hint = "leave out what is more, for example z: the third number is the heading"
        if len(raw) in (4, 6) and whole:
            hint = "write decimals with a point: 2.5"
        elif len(raw) < 2:
            hint = "write [x, y]"
        raise ParameterError("", f"a pose is [x, y] or [x, y, heading], got {shown(raw)}", hint)
    x, y = (read_number(item, "m") for item in raw[:2])
    heading = read_number(raw[2], "rad") if len(raw) == 3 else 0.0
    if max(abs(x), abs(y)) > FARTHEST:
        raise ParameterError("", f"({x:g}, {y:g}) m is farther than {FARTHEST:g} m from the origin")
    if abs(heading) > 2.0 * pi + 1e-9:  # almost certainly degrees
        sentence = f"a heading of {heading:g} rad is more than a full turn"
        if not _is_number(raw[2]):
            raise ParameterError("", sentence)
        fixed = f"[{raw[0]}, {raw[1]}, {raw[2]:g} deg]"
        raise ParameterError("", sentence, Hint(f"write {raw[2]:g} deg", fixed))
    return Pose2D(x, y, wrap_angle(heading))


def _hint(raw: Any) -> Hint:
    """How to write a pose that is written as a mapping or as text."""
    if isinstance(raw, Mapping) and {"x", "y"} <= raw.keys():
        heading = next((raw[name] for name in _HEADINGS if name in raw), None)
        values = [raw["x"], raw["y"], *([] if heading is None else [heading])]
        return write(f"[{', '.join(map(str, values))}]")
    if isinstance(raw, str) and raw.count(",") in (1, 2) and raw[:1].isdigit():
        return write(f"[{raw}]")
    return Hint()


def read_path(raw: Any) -> Path:
    """Convert a list of poses of a file; one without a heading gets that of the next segment.

    Raises:
        ParameterError: it is no list of at least two poses.
    """
    if not isinstance(raw, list | tuple):
        sentence = f"expected a path [[x, y], [x, y], …], got {shown(raw)}"
        raise ParameterError("", sentence)
    if len(raw) < 2:
        raise ParameterError("", f"a path has at least 2 poses, got {len(raw)}")
    for item in raw:
        if not isinstance(item, list | tuple):
            raise ParameterError("", f"a path is a list of poses, got {shown(item)} in it")
    points = np.array([(pose.x, pose.y, pose.heading) for pose in map(read_pose, raw)])
    steps = np.diff(points[:, :2], axis=0)
    along = np.arctan2(steps[:, 1], steps[:, 0])
    for number, item in enumerate(raw):
        if len(item) == 2:
            points[number, 2] = along[min(number, len(along) - 1)]
    return Path(points)


def _is_number(raw: Any) -> bool:
    return isinstance(raw, int | float) and not isinstance(raw, bool)
