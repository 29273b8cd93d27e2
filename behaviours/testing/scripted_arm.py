"""Arm and gripper of a scripted robot: plain attributes that tests of behaviours set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from behaviours.testing.scripted_task import ScriptedTask
from stack.types import FloatArray, GripperState, JointState, JointTrajectory

JOINTS = tuple(f"joint_{number}" for number in range(1, 8))

Begin = Callable[..., ScriptedTask]
"""begin(name, **arguments): records a call and returns its task."""


def _zeros() -> FloatArray:
    return np.zeros(len(JOINTS))


def _at_rest() -> JointState:
    return JointState(0.0, _zeros(), _zeros(), _zeros())


@dataclass
class ScriptedArm:
    """An arm of seven joints. `follow` is recorded; its task is the robot's newest one.

    Attributes:
        begin: records a call.
        task: of the newest motion; a newer one cancels it.
    """

    begin: Begin
    joint_names: tuple[str, ...] = JOINTS
    postures: Mapping[str, FloatArray] = field(default_factory=lambda: {"home": _zeros()})
    joints: JointState | None = field(default_factory=_at_rest)
    tool_pose: FloatArray | None = field(default_factory=lambda: np.eye(4))
    task: ScriptedTask = field(default_factory=ScriptedTask)

    def follow(self, trajectory: JointTrajectory) -> ScriptedTask:
        """Record the call."""
        self.task.cancel()
        self.task = self.begin("follow", trajectory=trajectory)
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
