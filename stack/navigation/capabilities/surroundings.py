"""What an arm must not touch: known boxes, blocks that were seen, the block in the hand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import ParameterError
from stack.frames.tree import inverse
from stack.manipulation.scene import Box, Cylinder, Scene, SceneObject
from stack.parameters import suggestion
from stack.types import Block, FloatArray

SPARE = 0.5
"""Metres beyond the arm's reach up to which objects count: the hand may hold something long."""

DEVIATIONS, MOST_GROWTH = 2.0, 0.1
"""Objects of the map are wider by so many standard deviations of the pose on each side, at most so
many metres: the arm is that far from where it is believed to be."""

SAME = 0.02
"""Metres between two places of a block that was seen twice."""


@dataclass(frozen=True)
class Held:
    """A block in the hand: its pose (4, 4) in the frame of the tool, and its width, metres."""

    name: str
    block: Block
    in_tool: FloatArray
    width: float


class Surroundings:
    """Objects around an arm, whose base may drive. Poses of blocks are in the odom frame.

    A block is seen from where the base stands. The odom frame is the one in which it stays there
    exactly, until the base drives: corrections of the pose on the map do not move it.

    Args:
        boxes: that are known and have names, map frame.
        others: known objects that are only avoided, map frame.
        reach: of the arm from its base link, metres.

    Attributes:
        held: the block in the hand; None: none.
        version: grows with each change.
    """

    def __init__(
        self, boxes: Sequence[SceneObject], others: Sequence[SceneObject] = (), reach: float = inf
    ) -> None:
        self._boxes = {item.name: item for item in boxes}
        self._others, self._reach = tuple(others), reach
        self._blocks: dict[str, Block] = {}
        self.held: Held | None = None
        self.version = 1

    def see(
        self, blocks: Iterable[Block], gone: Iterable[Block], tool: FloatArray | None,
        odom_from_map: FloatArray,
    ) -> tuple[Block, ...]:  # fmt: skip
        """Take what a look around has shown; return the blocks that count.

        Args:
            blocks: that were found; one in the hand, or inside a box, is none.
            gone: known ones that are not at their places any more; the others may be hidden.
            tool: (4, 4) of the tool, odom frame.
            odom_from_map: (4, 4) odom <- map.
        """
        held = None if tool is None else self.held_at(tool)
        boxes = [self.box(name, odom_from_map) for name in self._boxes]
        found = tuple(
            block for block in blocks
            if (held is None or _distance(held.pose, block.pose) >= np.linalg.norm(block.size))
            and not any(_is_inside(block.pose, *box) for box in boxes)
        )  # fmt: skip
        self.version += 1
        lost = list(gone)
        self._blocks = {
            name: known for name, known in self._blocks.items()
            if not any(_distance(known.pose, block.pose) < SAME for block in lost)
            and not any(_overlap(known, block) for block in found)
        }  # fmt: skip
        for block in found:
            self._blocks[self._new_name(block)] = block
        return found

    def name_of(self, block: Block) -> str:
        """Return the name of a block; one that was not seen before is added."""
        for name, known in self._blocks.items():
            if _distance(known.pose, block.pose) < SAME:
                return name
        name = self._new_name(block)
        self._blocks[name] = block
        self.version += 1
        return name

    def hold(self, block: Block, tool: FloatArray, width: float) -> None:
        """The hand has grasped a block, with the tool (4, 4) in the odom frame."""
        name = self.name_of(block)
        self._blocks.pop(name)
        self.held = Held(name, block, inverse(tool) @ block.pose, width)
        self.version += 1

    def held_at(self, tool: FloatArray) -> Block | None:
        """Return the block in the hand where it is with the tool at a pose (4, 4)."""
        held = self.held
        return None if held is None else replace(held.block, pose=tool @ held.in_tool)

    def release(self, tool: FloatArray) -> None:
        """The hand has left its block where the tool (4, 4) holds it; without one, do nothing."""
        block = self.held_at(tool)
        if self.held is not None and block is not None:
            self._blocks[self.held.name], self.held = replace(block, camera=""), None
            self.version += 1

    def lose(self) -> None:
        """The block in the hand is not there any more."""
        self.held = None
        self.version += 1

    @property
    def boxes(self) -> list[tuple[FloatArray, FloatArray]]:
        """Poses (4, 4), map frame, and sizes (3,) of the known boxes, metres."""
        every = self._boxes.values()
        return [(it.pose, np.array(it.shape.size)) for it in every if isinstance(it.shape, Box)]

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The blocks by name, without that in the hand."""
        return self._blocks

    def box(self, name: str, from_map: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return pose (4, 4) and size (3,) of a known box.

        Args:
            name: of the box.
            from_map: (4, 4) wanted frame <- map.

        Raises:
            ParameterError: there is none.
        """
        if name not in self._boxes:
            hint = suggestion(name, self._boxes)
            raise ParameterError("", f"no box of the world is called {name!r}", hint)
        item = self._boxes[name]
        assert isinstance(item.shape, Box)
        return from_map @ item.pose, np.array(item.shape.size)

    def scene(
        self, link_from_map: FloatArray, link_from_odom: FloatArray, width: float | None = None,
        deviations: tuple[float, float] = (0.0, 0.0),
    ) -> Scene:  # fmt: skip
        """Return all that the arm may reach, in the frame of its base link.

        Args:
            link_from_map: (4, 4) base link <- map.
            link_from_odom: (4, 4) base link <- odom.
            width: between the fingers, metres; None: open.
            deviations: standard deviations of the pose on the map: metres and radians.
        """
        placed = (
            replace(item, pose=link_from_map @ item.pose)
            for item in (*self._boxes.values(), *self._others)
        )
        known = (_grown(item, deviations) for item in placed)
        seen = (
            _object(name, block, link_from_odom @ block.pose)
            for name, block in self._blocks.items()
        )
        near = self._reach + SPARE
        objects = tuple(item for item in (*known, *seen) if _away(item) < near)
        scene = Scene(objects, width=width)
        if self.held is None:
            return scene
        held = _object(self.held.name, self.held.block, self.held.in_tool)
        return replace(scene, held=held, width=self.held.width)

    def _new_name(self, block: Block) -> str:
        name, number = f"{block.colour} block", 1
        taken = {*self._blocks, *self._boxes, *({self.held.name} if self.held else ())}
        while name in taken:
            number += 1
            name = f"{block.colour} block {number}"
        return name


def _grown(item: SceneObject, deviations: tuple[float, float]) -> SceneObject:
    """Return an upright object, wider by the doubt about where it is; its height is known."""
    off = float(np.hypot(deviations[0], deviations[1] * _away(item)))
    growth = min(DEVIATIONS * off, MOST_GROWTH)
    if isinstance(item.shape, Box):
        length, width, height = item.shape.size
        grown = Box((length + 2.0 * growth, width + 2.0 * growth, height))
        return replace(item, shape=grown)
    assert isinstance(item.shape, Cylinder)
    return replace(item, shape=replace(item.shape, radius=item.shape.radius + growth))


def _away(item: SceneObject) -> float:
    """Distance from the origin to a box or a cylinder, metres."""
    if isinstance(item.shape, Box):
        half = np.array(item.shape.size) / 2.0
    else:
        assert isinstance(item.shape, Cylinder)
        half = np.array((item.shape.radius, item.shape.radius, item.shape.length / 2.0))
    local = item.pose[:3, :3].T @ item.pose[:3, 3]
    return float(np.linalg.norm(np.maximum(np.abs(local) - half, 0.0)))


def _distance(one: FloatArray, other: FloatArray) -> float:
    return float(np.linalg.norm(one[:3, 3] - other[:3, 3]))


def _is_inside(pose: FloatArray, of: FloatArray, size: FloatArray) -> bool:
    """Whether the origin of a pose is inside a box, given by pose (4, 4) and size (3,)."""
    local = (inverse(of) @ pose)[:3, 3]
    return bool((np.abs(local) <= size / 2.0).all())


def _overlap(one: Block, other: Block) -> bool:
    """Whether the middle of one of two blocks is inside the other."""
    return _is_inside(one.pose, other.pose, other.size) or _is_inside(
        other.pose, one.pose, one.size
    )


def _object(name: str, block: Block, pose: FloatArray) -> SceneObject:
    length, width, height = block.size.tolist()
    return SceneObject(name, Box((length, width, height)), pose)


def reach_of(robot: RobotDescription) -> float:
    """Return how far the tool can be from the arm's base link at most, metres; 0 without one."""
    if robot.arm is None:
        return 0.0
    arm, above = robot.arm, {joint.child: joint for joint in robot.links}
    length, link = 0.0, arm.tool_link
    while link != arm.base_link:
        joint = above[link]
        length += arm.length_of(joint)
        link = joint.parent
    return length
