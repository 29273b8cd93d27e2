"""Arm and gripper of a scripted robot: plain attributes that tests of behaviours set."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from behaviours.testing.scripted_task import ScriptedTask
from stack.errors import ParameterError
from stack.types import (
    Block,
    FailureCode,
    FloatArray,
    GraspPlan,
    GripperState,
    JointState,
    JointTrajectory,
    PlacePlan,
)

JOINTS = tuple(f"joint_{number}" for number in range(1, 8))

Begin = Callable[..., ScriptedTask]
"""begin(name, **arguments): records a call and returns its task."""


def _zeros() -> FloatArray:
    return np.zeros(len(JOINTS))


def _at_rest() -> JointState:
    return JointState(0.0, _zeros(), _zeros(), _zeros())


@dataclass
class ScriptedGrasps(ScriptedTask):
    """A search for grasps; the test sets what was found."""

    grasps: tuple[GraspPlan, ...] = ()


@dataclass
class ScriptedPlace(ScriptedTask):
    """A search for a place; the test sets which of the poses is free."""

    place: PlacePlan | None = None


@dataclass
class ScriptedArm:
    """An arm of seven joints. Motions are recorded; their task is the robot's newest one.

    Attributes:
        begin: records a call.
        boxes: of the world: pose and size by name.
        grasps: what a search for grasps finds at once; without any it fails.
        free_place: number of the pose that a search for a place finds at once; beyond the last
            one it fails.
        told: what the operator was told.
        task: of the newest motion; a newer one cancels it.
    """

    begin: Begin
    joint_names: tuple[str, ...] = JOINTS
    postures: Mapping[str, FloatArray] = field(default_factory=lambda: {"home": _zeros()})
    joints: JointState | None = field(default_factory=_at_rest)
    tool_pose: FloatArray | None = field(default_factory=lambda: np.eye(4))
    camera_in_tool: FloatArray | None = field(default_factory=lambda: np.eye(4))
    blocks: dict[str, Block] = field(default_factory=dict)
    held: Block | None = None
    boxes: dict[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    grasps: tuple[GraspPlan, ...] = ()
    free_place: int = 0
    told: list[str] = field(default_factory=list)
    task: ScriptedTask = field(default_factory=ScriptedTask)

    def box(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return a box that the test has set."""
        if name not in self.boxes:
            raise ParameterError("", f"no box of the world is called {name!r}")
        return self.boxes[name]

    def see(self, blocks: Iterable[Block], gone: Iterable[Block] = ()) -> tuple[Block, ...]:
        """Add blocks; forget those that are gone, and those at the places of new ones."""
        found = tuple(blocks)
        lost = [it.pose[:3, 3] for it in (*gone, *found)]
        kept = [
            it for it in self.blocks.values()
            if all(np.linalg.norm(it.pose[:3, 3] - place) > 0.02 for place in lost)
        ]  # fmt: skip
        self.blocks = {f"{it.colour} {number}": it for number, it in enumerate((*kept, *found))}
        return found

    def hold(self, block: Block, width: float) -> None:
        """Hold a block."""
        self.blocks = {name: it for name, it in self.blocks.items() if it is not block}
        self.held = block

    def release(self, *, lost: bool = False) -> None:
        """Hold nothing."""
        self.held = None

    def tell(self, did: str, text: str, **fields: float | str) -> None:
        """Keep the text."""
        self.told.append(text)

    def follow(self, trajectory: JointTrajectory, *, fixed: bool = True) -> ScriptedTask:
        """Record the call."""
        return self._move("follow", trajectory=trajectory, fixed=fixed)

    def move_joints(self, positions: FloatArray, *, speed: float = 1.0) -> ScriptedTask:
        """Record the call."""
        return self._move("move_joints", positions=positions, speed=speed)

    def move_to_posture(self, name: str, *, speed: float = 1.0) -> ScriptedTask:
        """Record the call."""
        if name not in self.postures:
            raise ParameterError("posture", f"the arm has no posture {name!r}")
        return self._move("move_to_posture", name=name, speed=speed)

    def move_tool(
        self, pose: FloatArray, *, straight: bool = False, touching: Iterable[Block | str] = (),
        width: float | None = None, speed: float = 1.0,
    ) -> ScriptedTask:  # fmt: skip
        """Record the call."""
        return self._move(
            "move_tool", pose=pose, straight=straight, touching=tuple(touching), width=width,
            speed=speed,
        )  # fmt: skip

    def plan_grasps(self, block: Block) -> ScriptedGrasps:
        """Record the call; the search has ended."""
        self._move("plan_grasps", block=block).succeed()
        search = ScriptedGrasps(grasps=self.grasps)
        if self.grasps:
            search.succeed()
        else:
            search.fail(FailureCode.NO_MOTION_PLAN, "no grasp: set by the test")
        return search

    def plan_place(
        self, tools: Sequence[FloatArray], *, above: float, width: float
    ) -> ScriptedPlace:
        """Record the call; the search has ended."""
        self._move("plan_place", tools=tuple(tools), above=above, width=width).succeed()
        search = ScriptedPlace()
        if self.free_place < len(tools):
            rest = JointTrajectory(np.zeros(1), _zeros()[None], _zeros()[None])
            search.place = PlacePlan(tools[self.free_place], rest)
            search.succeed()
        else:
            search.fail(FailureCode.NO_MOTION_PLAN, "no place: set by the test")
        return search

    def _move(self, call: str, **arguments: Any) -> ScriptedTask:
        self.task.cancel()
        self.task = self.begin(call, **arguments)
        return self.task


@dataclass
class ScriptedGripper:
    """A gripper, open at first. `move` is recorded; its task is the robot's newest one.

    Attributes:
        begin: records a call.
        task: of the newest motion; a newer one cancels it.
    """

    begin: Begin
    state: GripperState | None = field(
        default_factory=lambda: GripperState(0.0, 0.08, 0.0, moving=False)
    )
    width_max: float = 0.08
    task: ScriptedTask = field(default_factory=ScriptedTask)

    def move(self, width: float, force: float | None = None) -> ScriptedTask:
        """Record the call."""
        self.task.cancel()
        self.task = self.begin("move", width=width, force=force)
        return self.task
