"""What behaviours and components need of a robot: the table of names, and who has it.

A behaviour needs what it claims without saying so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription

_OR = " or "


@dataclass(frozen=True, slots=True)
class Need:
    """Something that a robot can have.

    Attributes:
        noun: in messages.
        found: its names in the robot file; empty if the robot has none.
    """

    noun: str
    found: Callable[[RobotDescription], Iterable[str]]


SENSORS: Mapping[str, Need] = {
    "lidar": Need("lidar", lambda robot: robot.all_lidars),
    "camera": Need("camera", lambda robot: ("camera",) if robot.camera else ()),
    "depth_camera": Need("depth camera", lambda robot: robot.depth_cameras),
    "sonar": Need("sonar", lambda robot: robot.sonars),
    "imu": Need("IMU", lambda robot: ("imu",) if robot.imu else ()),
}
"""A virtual scan of a depth camera is a lidar."""

LIMBS: Mapping[str, Need] = {
    "base": Need("drive", lambda robot: ("wheels",) if robot.drivetrain.moves else ()),
    "arm": Need("arm", lambda robot: ("arm",) if robot.arm else ()),
    "gripper": Need(
        "gripper", lambda robot: ("gripper",) if robot.arm and robot.arm.gripper else ()
    ),
}

NEEDS: Mapping[str, Need] = {**SENSORS, **LIMBS}
"""Names in `needs`."""


RESOURCES = (*LIMBS, "camera")
"""Names in `claims`: what one behaviour at a time can use."""


def alternatives(need: str) -> list[str]:
    """Return the names in one entry of `needs`, of which one is enough: `lidar or sonar`."""
    return need.split(_OR)


def noun_of(need: str) -> str:
    """Return an entry of `needs` in words: `lidar or depth camera`."""
    return _OR.join(NEEDS[name].noun for name in alternatives(need))


def needs_text(needs: Iterable[str]) -> str:
    """Return what is needed as a line for people: `needs: camera`; "" without needs."""
    words = ", ".join(noun_of(need) for need in needs)
    return f"needs: {words}" if words else ""


def needs_problem(needs: object) -> str:
    """Return what is wrong with `needs` of a class; "" if nothing is."""
    if not isinstance(needs, tuple):
        return f'needs: expected a tuple of names, got {needs!r}; write needs = ("camera",)'
    for need in needs:
        for name in alternatives(str(need)):
            if name not in NEEDS:
                return f"needs: {name!r} is not one of {', '.join(NEEDS)}"
    return ""


def claims_problem(claims: object) -> str:
    """Return what is wrong with `claims` of a class; "" if nothing is."""
    if not isinstance(claims, tuple):
        return f'claims: expected a tuple of names, got {claims!r}; write claims = ("base",)'
    for name in claims:
        if name not in RESOURCES:
            return f"claims: {name!r} is not one of {', '.join(RESOURCES)}"
    return ""


def lacking(needs: Iterable[str], robot: RobotDescription) -> Iterator[str]:
    """Yield the entries of `needs` that a robot does not meet."""
    for need in needs:
        if not any(any(NEEDS[name].found(robot)) for name in alternatives(need)):
            yield need


def sensors_of(robot: RobotDescription) -> dict[str, str]:
    """Return the sensors of a robot: name -> kind, in words."""
    return {name: need.noun for need in SENSORS.values() for name in need.found(robot)}
