"""Compares an arm with the base that carries it: what it covers, and what it does to the balance.

The base drives only while the arm is at `home`; it stands while the arm moves.

Code: W303 what is probably unintended.
"""

from __future__ import annotations

import numpy as np

from robots.declared import DIFFERS
from robots.urdf.extent import points_of
from robots.urdf.model import Inertial, RobotModel, combined, inertial_of
from stack.documents import Section
from stack.drivetrain.arm_description import HOME
from stack.drivetrain.description import RobotDescription
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.types import FloatArray

BEYOND = 0.02
"""Metres by which an arm may be outside footprint and height."""

WAYS = 201
"""Directions in which the arm is stretched out: every 1.8 degrees."""


def links_of_arm(model: RobotModel, robot: RobotDescription) -> set[str]:
    """The links that an arm moves: they are not part of the outline."""
    if robot.arm is None:
        return set()
    first = model.joints[robot.arm.joints[0]]
    return {first.child, *(joint.child for joint in model.downwards(first.child))}


def bodies_at_home(model: RobotModel, robot: RobotDescription) -> list[Inertial]:
    """Return the bodies of all links in the root's frame, with an arm at `home`."""
    poses = _at_home(model, robot)
    return [
        inertial.moved(poses[name])
        for name, link in model.links.items()
        if (inertial := inertial_of(link)) is not None
    ]


def check_arm_at_home(
    top: Section, model: RobotModel, base: FloatArray, robot: RobotDescription
) -> None:
    """Warn of an arm that is beyond footprint or height at `home`, or tips the base over.

    Args:
        top: the robot file.
        model: of the robot.
        base: (3,) origin of the base frame in the root's frame, metres.
        robot: as described.
    """
    if robot.arm is None:
        return
    poses, moved = _at_home(model, robot), links_of_arm(model, robot)
    found = {
        name: points_of(model, name, "collision", meshes=True, at=poses[name]) - base
        for name in sorted(moved)
    }
    mark = (top.node.get("arm") or top.node).mark
    for name, points in found.items():
        outside = points[~points_inside(points[:, :2], robot.footprint.points)][:, :2]
        away = float(distances_to_edges(outside, robot.footprint.points).max(initial=0.0))
        above = float(points[:, 2].max(initial=0.0)) - robot.height
        for key, far in (("footprint", away), ("height", above)):
            if far > BEYOND:
                sentence = f"arm: at `{HOME}` the link {name!r} is {far:.3f} m beyond the {key}"
                hint = "the base drives with the arm there: fold it, or enlarge the " + key
                top.findings.add(DIFFERS, mark, sentence, hint)
    _check_stretched(top, model, base, robot)


def _check_stretched(
    top: Section, model: RobotModel, base: FloatArray, robot: RobotDescription
) -> None:
    """Warn of an arm that tips the base over where it is stretched out.

    The centre of mass of all must stay above the footprint. A link of the arm is at most as far
    from the first joint as the lengths before it, and the travel of joints that slide, allow.
    """
    assert robot.arm is not None
    moved = links_of_arm(model, robot)
    first = model.joints[robot.arm.joints[0]]
    level = float(np.linalg.norm(model.axis_of(first)[:2]))
    away = {first.child: level * robot.arm.travel_of(first.name, first.kind)}
    for joint in robot.links:  # parents first
        if joint.parent in away:
            away[joint.child] = away[joint.parent] + robot.arm.length_of(joint)
    rest = [
        inertial.moved(model.poses[name])
        for name, link in model.links.items()
        if name not in moved and (inertial := inertial_of(link)) is not None
    ]
    arm = {name: it for name in away if (it := inertial_of(model.links[name])) is not None}
    mass = sum(it.mass for it in arm.values())
    moment = sum(it.mass * (away[name] + _off(it)) for name, it in arm.items())
    body, pivot = combined(rest), model.poses[first.child][:2, 3] - base[:2]
    if not body.mass + mass:
        return
    angles = np.linspace(0.0, 2.0 * np.pi, WAYS)
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    centres = body.mass * (body.centre[:2] - base[:2]) + mass * pivot + moment * ways
    centres /= body.mass + mass
    outside = ~points_inside(centres, robot.footprint.points)
    if outside.any():
        x, y = centres[outside][0].round(2).tolist()
        sentence = (
            f"arm: stretched out, it may tip the base over: the centre of mass is then at [{x:g}, "
            f"{y:g}] in the base frame, outside the footprint"
        )
        hint = "make the base heavier or wider, or move the arm to its middle"
        top.findings.add(DIFFERS, (top.node.get("arm") or top.node).mark, sentence, hint)


def _off(body: Inertial) -> float:
    return float(np.linalg.norm(body.centre))


def _at_home(model: RobotModel, robot: RobotDescription) -> dict[str, FloatArray]:
    """Return the poses of all links in the root's frame, with an arm at `home`."""
    if robot.arm is None:
        return model.poses
    home = robot.arm.postures[HOME].tolist()
    return model.posed(dict(zip(robot.arm.joints, home, strict=True)))
