"""Goals and poses as people write them: a place, or x, y and heading with units."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2

from stack.errors import InputError, ParameterError
from stack.parameters import read_quantity, suggestion
from stack.types import Pose2D

UNITS = ("m", "m", "rad")


def pose_of(
    goal: str | Pose2D | float, y: float | None, heading: float | str | None,
    places: Mapping[str, Pose2D], robot: Pose2D,
) -> Pose2D:  # fmt: skip
    """Return the pose, map frame, that arguments of a call mean.

    Args:
        goal: a pose, the name of a place, a text such as `3.2, 1.1, 90deg`, or x in metres.
        y: metres, with x.
        heading: radians or a text such as `90 deg`, with x; None: as the straight line to there.
        places: of the run.
        robot: where the robot is, map frame.

    Raises:
        InputError: there is no such place, or a number is wrong.
    """
    if isinstance(goal, Pose2D):
        return goal
    if isinstance(goal, str):
        if y is not None or heading is not None:
            raise InputError(f"{goal!r} is a whole goal; leave out y and heading")
        return _named(goal, places, robot)
    if y is None:
        raise InputError(f"a goal at x {goal:g} needs y: goto(x, y, heading)")
    return _at([f"{goal!r}", f"{y!r}", *([] if heading is None else [f"{heading}"])], robot)


def _named(text: str, places: Mapping[str, Pose2D], robot: Pose2D) -> Pose2D:
    if text in places:
        return places[text]
    parts = text.strip("[] ").split(",")
    if len(parts) not in (2, 3):
        hint = suggestion(text, places) if places else "this run has no places"
        raise InputError(f"no place {text!r}; {hint}, or write x,y,heading such as 3.2,1.1,90deg")
    return _at(parts, robot)


def _at(parts: list[str], robot: Pose2D) -> Pose2D:
    try:
        x, y, *heading = map(read_quantity, parts, UNITS)
    except ParameterError as error:
        hint = f"; {error.hint}" if error.hint else ""
        raise InputError(f"{','.join(parts)}: {error.sentence}{hint}") from None
    return Pose2D(x, y, heading[0] if heading else atan2(y - robot.y, x - robot.x))
