"""Preflight: the checks of a robot before it drives."""

from __future__ import annotations

from collections.abc import Iterator

from missions.commissioning.checks import Check, failures
from missions.commissioning.standing import check_standing
from stack.body import Body
from stack.errors import BodyError


def preflight(body: Body, *, pictures: bool = False) -> Iterator[Check]:
    """Check a robot; yield each check as soon as it is made.

    Args:
        body: the robot.
        pictures: whether cameras are checked too.
    """
    yield from check_standing(body, pictures=pictures)


def require_ready(body: Body) -> None:
    """Make the checks without motion before a mission on a real robot.

    Raises:
        BodyError: checks failed; the message names them with their remedies.
    """
    wrong = failures(check_standing(body))
    if wrong:
        lines = [f"{check.name}: {check.found}; {check.remedy}" for check in wrong]
        raise BodyError("preflight failed: " + "\n  ".join(lines))
