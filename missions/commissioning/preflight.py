"""Preflight: the checks of a robot before it drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict

from missions.commissioning.checks import Check, failures
from missions.commissioning.moving import check_moving
from missions.commissioning.standing import check_standing
from stack.body import Body
from stack.errors import BodyError


def preflight(
    body: Body, confirms: Callable[[str], bool] | None = None, *, pictures: bool = False,
    estop: bool = False,
) -> Iterator[Check]:  # fmt: skip
    """Check a robot; yield each check as soon as it is made.

    A robot that fails a check at standstill does not move.

    Args:
        body: the robot.
        confirms: asks the operator before the robot moves; None: it does not move.
        pictures: whether cameras are checked too.
        estop: whether the operator presses the emergency stop for a test.
    """
    wrong = False
    for check in check_standing(body, pictures=pictures):
        wrong |= check.outcome == "failed"
        yield check
    if confirms is None:
        return
    if wrong:
        yield Check("motion", "skipped", "a robot that fails a check does not move")
        return
    yield from check_moving(body, confirms, estop=estop)


def require_ready(body: Body, emit: Callable[..., object]) -> None:
    """Make the checks without motion before a mission on a real robot; an event lists them.

    Args:
        body: the robot.
        emit: called with (kind, text, level=…, checks=…).

    Raises:
        BodyError: checks failed; the message names them with their remedies.
    """
    checks = tuple(check_standing(body))
    wrong = failures(checks)
    words = "\n  ".join(f"{check.name}: {check.found}; {check.remedy}" for check in wrong)
    text = (
        f"preflight failed: {words}" if wrong else f"preflight: {len(checks)} checks, none failed"
    )
    listed = [asdict(check) for check in checks]
    emit("preflight", text, level="error" if wrong else "info", checks=listed)
    if wrong:
        raise BodyError(f"{text}\n  a mission starts without them with --skip-preflight")
