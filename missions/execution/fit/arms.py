"""What the behaviours of arms name: postures of the robot, boxes of the world, goals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from missions.execution.fit.steps import every_leaf
from missions.language.analysis.claims import mark_of
from missions.language.kinds.leaf import LeafStep
from missions.language.model import Mission
from missions.language.values import Constant
from stack.documents import Finding
from stack.drivetrain.arm_description import ArmDescription
from stack.drivetrain.description import RobotDescription
from stack.geometry.rotations import from_angles
from stack.manipulation.scene import Box, Cylinder, SceneObject
from stack.optional_packages import MISSING_PACKAGE, PINOCCHIO
from stack.parameters import suggestion
from stack.sim.worlds.outlines import wall_slabs
from stack.sim.worlds.world import World
from stack.types import Pose2D

FLOOR = 0.1
"""Thickness of the floor, metres."""

VALUE, UNSEEN = "E132", "W152"
"""The codes of a value of a port, and of a block that nothing finds."""


def boxes_of(world: World) -> Mapping[str, SceneObject]:
    """Return the boxes of a world by name, map frame; those of one name get numbers."""
    found: dict[str, SceneObject] = {}
    for box in world.boxes:
        name = first = box.name or "a box"
        number = 1
        while name in found:
            number += 1
            name = f"{first} {number}"
        at, height = box.pose, box.elevation + box.size[2] / 2.0
        pose = from_angles((at.x, at.y, height), (0.0, 0.0, at.heading))
        found[name] = SceneObject(name, Box(box.size), pose)
    return found


def others_of(world: World) -> tuple[SceneObject, ...]:
    """Return the floor, the walls and the cylinders of a world, map frame."""
    x_min, y_min, x_max, y_max = world.bounds
    middle = from_angles(
        ((x_min + x_max) / 2.0, (y_min + y_max) / 2.0, -FLOOR / 2.0), (0.0, 0.0, 0.0)
    )
    found = [SceneObject("the floor", Box((x_max - x_min, y_max - y_min, FLOOR)), middle)]
    for wall in world.walls:
        for slab in wall_slabs(wall):
            size = 2.0 * slab.half_length, 2.0 * slab.half_width, wall.height
            found.append(_standing(f"wall {len(found)}", Box(size), slab.pose))
    for item in world.cylinders:
        shape = Cylinder(item.radius, item.height)
        found.append(_standing(f"cylinder {len(found)}", shape, Pose2D(item.x, item.y)))
    return tuple(found)


def _standing(name: str, shape: Box | Cylinder, at: Pose2D) -> SceneObject:
    """Return an object that stands on the floor."""
    height = shape.size[2] if isinstance(shape, Box) else shape.length
    pose = from_angles((at.x, at.y, height / 2.0), (0.0, 0.0, at.heading))
    return SceneObject(name, shape, pose)


def arm_findings(mission: Mission, robot: RobotDescription, world: World) -> Iterator[Finding]:
    """Yield errors of behaviours that name what robot or world do not have."""
    yield from unseen_blocks(mission)
    boxes = boxes_of(world)
    for step in every_leaf(mission):
        wrong = list(_goals(step))
        yield from wrong
        if robot.arm is not None and not wrong:
            yield from _postures(step, robot.arm, robot.name)
            yield from _joints(step, robot.arm, robot.name)
        yield from _boxes(step, boxes, world.name)
        if "arm" in step.behaviour.needs and not PINOCCHIO.is_installed:
            sentence = f"{step.kind} needs {PINOCCHIO.absence}"
            yield Finding(step.mark, MISSING_PACKAGE, sentence, PINOCCHIO.hint)


def unseen_blocks(mission: Mission) -> Iterator[Finding]:
    """Yield warnings of behaviours that use a block which was found, if nothing finds any.

    A behaviour of a plugin may do so.
    """
    leaves = list(every_leaf(mission))
    if any(leaf.behaviour.finds_blocks or not leaf.behaviour.is_built_in for leaf in leaves):
        return
    for leaf in leaves:
        port = leaf.behaviour.block_port
        value = leaf.ports.get(port)
        if port and (value is None or (isinstance(value, Constant) and value.value is None)):
            sentence = f"{leaf.kind} knows no block: nothing in the mission finds any"
            yield Finding(leaf.mark, UNSEEN, sentence, f"use detect_blocks before it, or `{port}`")


def _goals(step: LeafStep) -> Iterator[Finding]:
    """Yield an error unless exactly one of the ports that exclude each other is given."""
    ports = step.behaviour.one_port_of
    given = [port for port in ports if port in step.ports]
    if ports and len(given) != 1:
        sentence = f"{step.kind} needs exactly one of {', '.join(ports)}; it has {len(given)}"
        hint = f"write for example `{step.kind}: {{{ports[0]}: …}}`"
        yield Finding(step.mark, VALUE, sentence, hint)


def _postures(step: LeafStep, arm: ArmDescription, robot: str) -> Iterator[Finding]:
    value = step.ports.get(step.behaviour.posture_port)
    if isinstance(value, Constant) and value.value not in arm.postures:
        sentence = f"{step.behaviour.posture_port}: {robot} has no posture {value.value!r}"
        hint = suggestion(str(value.value), arm.postures)
        yield Finding(mark_of(value, step.mark), VALUE, sentence, hint)


def _joints(step: LeafStep, arm: ArmDescription, robot: str) -> Iterator[Finding]:
    port = step.behaviour.joints_port
    value = step.ports.get(port)
    if not isinstance(value, Constant) or not isinstance(value.value, list | tuple):
        return
    mark, count = mark_of(value, step.mark), len(arm.joints)
    if len(value.value) != count:
        sentence = f"{port}: {robot} has {count} joints, got {len(value.value)} positions"
        yield Finding(mark, VALUE, sentence, f"in the order {', '.join(arm.joints)}")
        return
    ranges = zip(arm.joints, value.value, arm.limits.lower, arm.limits.upper, strict=True)
    for name, position, low, high in ranges:
        if not low <= float(position) <= high:
            sentence = f"{port}: {name} would be at {position:g} rad"
            yield Finding(mark, VALUE, sentence, f"its limits are {low:g} and {high:g}")


def _boxes(step: LeafStep, boxes: Mapping[str, SceneObject], world: str) -> Iterator[Finding]:
    for port in step.behaviour.box_ports:
        value = step.ports.get(port)
        if not isinstance(value, Constant) or value.value is None:
            continue
        names = value.value if isinstance(value.value, list | tuple) else [value.value]
        for name in names:
            if name not in boxes:
                sentence = f"{port}: the world {world} has no box {name!r}"
                hint = suggestion(str(name), boxes)
                yield Finding(mark_of(value, step.mark), VALUE, sentence, hint)
