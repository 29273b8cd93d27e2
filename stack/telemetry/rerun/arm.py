"""The arm in rerun: its joints, the way of the tool, grasps and the block in the hand."""

from __future__ import annotations

import numpy as np
import rerun as rr
from rerun.urdf import UrdfTree

from stack.telemetry.rerun.recording import BASE, Recording
from stack.types import ArmView, FloatArray, HeldBlock

WAY, GRASPS, HELD_BLOCK = "world/tool_way", "world/grasps", "world/held_block"

HAND = "held_block"
"""Frame of the block in the hand."""

WAY_COLOUR = (70, 226, 160)
BEST_COLOUR, OTHER_COLOUR = (255, 120, 190), (150, 96, 128)
"""Of the best grasp, and of the others."""

FINGER, STEM = 0.05, 0.05
"""Drawn lengths of the fingers of a grasp, and of what carries them, metres."""

SAME = 1e-4
"""Change of a joint's position that is not drawn, radians or metres."""


class ArmDrawing:
    """Draws an arm into a recording.

    Args:
        recording: to draw into.
        model: the robot's URDF, as it was drawn; None without one.
    """

    def __init__(self, recording: Recording, model: UrdfTree | None) -> None:
        self._recording = recording
        self._joints = {} if model is None else {joint.name: joint for joint in model.joints()}
        self._positions: dict[str, float] = {}
        self._way: FloatArray | None = None
        self._grasps = np.zeros((0, 4, 4))
        self._held: HeldBlock | None = None
        in_hand = rr.Transform3D(parent_frame=BASE, child_frame=HAND)
        recording.at(0.0)
        recording.stream.log("world/joints/held", in_hand)

    def draw(self, arm: ArmView) -> None:
        """Draw its state at the current time."""
        self._move({**dict(zip(arm.joints, arm.positions.tolist(), strict=True)), **arm.fingers})
        self._draw_way(arm.way)
        if not np.array_equal(arm.grasps, self._grasps):
            self._grasps = arm.grasps
            self._draw_grasps(arm.grasps, arm.width_max)
        self._draw_held(arm)
        self._recording.row("plots/joints", rr.Scalars, scalars=(arm.speed,))
        fingers = 1e3 * arm.width, arm.force
        self._recording.row("plots/fingers", rr.Scalars, scalars=fingers)

    def _move(self, positions: dict[str, float]) -> None:
        for name, position in positions.items():
            joint, before = self._joints.get(name), self._positions.get(name)
            if joint is None or (before is not None and abs(position - before) < SAME):
                continue
            self._positions[name] = position
            moved = joint.compute_transform(position, clamp=False)
            self._recording.stream.log(f"world/joints/{name}", moved)

    def _draw_way(self, way: FloatArray) -> None:
        if self._way is not None and np.array_equal(way, self._way):
            return
        self._way = way
        if len(way) < 2:
            self._recording.hide(WAY)
            return
        self._recording.frame(WAY, BASE)
        self._recording.show(WAY, rr.LineStrips3D([way], radii=0.004, colors=WAY_COLOUR))

    def _draw_grasps(self, grasps: FloatArray, open_width: float) -> None:
        if not len(grasps):
            self._recording.hide(GRASPS)
            return
        self._recording.frame(GRASPS, BASE)
        strips = [part for grasp in grasps for part in hand(grasp, open_width)]
        colours = np.repeat([BEST_COLOUR, *[OTHER_COLOUR] * (len(grasps) - 1)], 2, axis=0)
        self._recording.show(GRASPS, rr.LineStrips3D(strips, radii=0.003, colors=colours))

    def _draw_held(self, arm: ArmView) -> None:
        held = arm.held
        if held is None:
            self._recording.hide(HELD_BLOCK)
            self._held = None
            return
        if self._held is None or held.size.tolist() != self._held.size.tolist():
            colour = tuple(round(255 * part) for part in held.colour)
            box = rr.Boxes3D(sizes=[held.size], colors=[colour], fill_mode="solid")
            self._recording.frame(HELD_BLOCK, HAND)
            self._recording.show(HELD_BLOCK, box)
        self._held = held
        place = rr.Transform3D(
            translation=held.pose[:3, 3], mat3x3=held.pose[:3, :3],
            parent_frame=BASE, child_frame=HAND,
        )  # fmt: skip
        self._recording.stream.log("world/joints/held", place)


def hand(tool: FloatArray, width: float) -> list[FloatArray]:
    """Lines (k, 3) that draw a gripper: fingers with what joins them, and a stem.

    Args:
        tool: (4, 4) pose of the tool, metres.
        width: between the fingers, metres.
    """
    half = width / 2.0
    fingers = [(0.0, -half, 0.0), (0.0, -half, -FINGER), (0.0, half, -FINGER), (0.0, half, 0.0)]
    stem = [(0.0, 0.0, -FINGER), (0.0, 0.0, -FINGER - STEM)]
    return [np.array(line) @ tool[:3, :3].T + tool[:3, 3] for line in (fingers, stem)]
