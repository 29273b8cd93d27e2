"""Grasps of box-shaped blocks by a parallel gripper.

A grasp approaches one of five faces of the block (not that below) along its normal, with the
fingers along either of the two other axes, in either direction. If no grasp with open fingers has
room, the fingers open no wider than they need, reach less deep, and may grasp the ends of a long
block. Candidates remain whose gripper
opens wide enough, whose poses the arm reaches, and whose motions are free: a pre-grasp in front of
the face, a straight approach, and a straight lift with the block in the hand. Their order is by

    cost = largest motion of a joint from now to the pre-grasp, radians
         + 10 rad/m × what lacks to 5 cm of clearance at the grasp
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import cos, radians, sin

import numpy as np

from stack.errors import NavigationError
from stack.manipulation.collisions import Collisions
from stack.manipulation.planner import ArmBlocked, ArmPlanner, place_of
from stack.manipulation.scene import Box, Scene, SceneObject
from stack.types import FailureCode, FloatArray

APPROACH = 0.09
"""Metres of the straight approach."""

LIFT = 0.09
"""Metres of the straight lift."""

DEPTH, SHALLOW = 0.03, 0.005
"""Metres: how deep the tool reaches over the face at most. A shallow grasp keeps the hand off the
neighbours of the block; the finger tips reach some millimetres deeper than the tool."""

TILTS = tuple(sign * radians(angle) for angle in (25.0, 50.0) for sign in (1.0, -1.0))
"""Radians by which a tight grasp from above is turned about the line between the fingers: the hand,
which is wide along that line, then passes a neighbour that is higher than the block."""

PAD = 0.012
"""Metres from the middle of the fingers to the end of a long block that is grasped there."""

SPARE = 0.005
"""Metres that the open fingers are wider than the block, on each side."""

ROOM = 0.05
"""Metres: more clearance does not make a grasp better."""

PER_METRE = 10.0
"""Radians of cost per metre that lacks to `ROOM`."""

SUPPORT = 0.005
"""Metres: what is nearer to the block supports it, and may touch it when it is lifted."""

POSTURES, RESTARTS = 3, 8
"""Solutions for each pose, and searches for them; there are many other candidates."""


@dataclass(frozen=True)
class Grasp:
    """A grasp with its motions.

    Attributes:
        name: as in "from above, fingers along y": axes of the block.
        pre_grasp: (n,) positions in front of the block, fingers open.
        approach: (k, n) waypoints from the pre-grasp to the grasp.
        lift: (k, n) waypoints from the grasp upwards, with the block.
        tool: (4, 4) of the tool at the grasp, in `base_link`.
        width: of the block between the fingers, metres.
        opening: distance between the fingers before they close, metres.
        approaching: scene of the approach, in which the fingers may touch the block.
        lifting: scene of the lift, in which the block may touch what it stands on or beside.
        holding: scene after the lift.
        cost: radians.
    """

    name: str
    pre_grasp: FloatArray
    approach: FloatArray
    lift: FloatArray
    tool: FloatArray
    width: float
    opening: float
    approaching: Scene
    lifting: Scene
    holding: Scene
    cost: float


@dataclass(frozen=True)
class _Candidate:
    name: str
    tool: FloatArray
    width: float
    tight: bool


def grasps(
    planner: ArmPlanner,
    block: str,
    scene: Scene,
    positions: FloatArray,
    generator: np.random.Generator,
) -> list[Grasp]:
    """Return the grasps of a block, the cheapest first.

    Args:
        planner: of the arm.
        block: name of an object of the scene; a box.
        scene: with the block.
        positions: (n,) of the joints now.
        generator: of the inverse kinematics.

    Raises:
        NavigationError: OBJECT_NOT_FOUND if the scene has no such block, NO_MOTION_PLAN if there is
            no grasp; the sentence says what is wrong with the candidates.
    """
    item = _block(block, scene)
    gripper = planner.model.description.gripper
    if gripper is None:
        raise NavigationError(FailureCode.UNSUPPORTED, "the arm has no gripper")
    scene = scene.touching(*((finger, block) for finger in gripper.finger_links))
    styles = (
        candidates(item), candidates(item, tight=True), candidates(item, tight=True, tilts=TILTS),
    )  # fmt: skip
    reasons: Counter[str] = Counter()
    for style in styles:
        found, refused = _free(planner, style, (block, scene), positions, generator)
        if found:
            return found
        reasons = reasons or refused
    words = "; ".join(f"{count} {reason}" for reason, count in reasons.most_common(4))
    raise NavigationError(FailureCode.NO_MOTION_PLAN, f"no grasp of {block}: {words}")


def _free(
    planner: ArmPlanner, tried: Iterable[_Candidate], target: tuple[str, Scene],
    positions: FloatArray, generator: np.random.Generator,
) -> tuple[list[Grasp], Counter[str]]:  # fmt: skip
    """Return the grasps with free motions, the cheapest first, and why the others have none."""
    found: list[Grasp] = []
    refused: Counter[str] = Counter()
    block, scene = target
    assert planner.model.description.gripper is not None
    widest = planner.model.description.gripper.width_max
    for candidate in tried:
        needed = candidate.width + 2.0 * SPARE
        if needed > widest:
            refused[f"wider than the gripper opens ({widest * 1000:.0f} mm)"] += 1
            continue
        open_scene = replace(scene, width=needed if candidate.tight else widest)
        try:
            grasp = _with_motions(planner, candidate, (block, open_scene), positions, generator)
        except NavigationError as error:
            refused[refusal(error)] += 1
            continue
        checks = Collisions(planner.model, open_scene)
        room = min(checks.distance(grasp.approach[-1]), ROOM)
        found.append(replace(grasp, cost=grasp.cost + PER_METRE * (ROOM - room)))
    return sorted(found, key=lambda grasp: grasp.cost), refused


def candidates(
    item: SceneObject, *, tight: bool = False, tilts: Sequence[float] = (0.0,)
) -> Iterator[_Candidate]:
    """Yield the poses of the tool at the grasps of a block, and the widths between the fingers.

    Args:
        item: a box.
        tight: whether other objects are near it.
        tilts: turns of the tool about the line between the fingers, radians; not at the sides.
    """
    assert isinstance(item.shape, Box)
    size = np.array(item.shape.size)
    turn = item.pose[:3, :3]
    names = ("x", "y", "z")
    for normal in range(3):
        for sign in (1.0, -1.0):
            outward = sign * turn[:, normal]
            if outward[2] < -0.7:  # the face below
                continue
            depth = min(size[normal] / 2.0, SHALLOW if tight else DEPTH)
            tip = item.pose[:3, 3] + outward * (size[normal] / 2.0 - depth)
            side = "from above" if outward[2] > 0.7 else f"from {'+' if sign > 0 else '-'}"
            side += "" if outward[2] > 0.7 else names[normal]
            if tilts != (0.0,) and outward[2] < 0.7:
                continue
            for finger in {0, 1, 2} - {normal}:
                (along,) = {0, 1, 2} - {normal, finger}
                aside = size[along] / 2.0 - PAD if tight else 0.0
                offsets = (0.0, aside, -aside) if aside > PAD else (0.0,)
                for tilt, way, offset in product(tilts, (1.0, -1.0), offsets):
                    tool = np.eye(4)
                    tool[:3, 2] = -cos(tilt) * outward - sin(tilt) * turn[:, along]
                    tool[:3, 1] = way * turn[:, finger]
                    tool[:3, 0] = np.cross(tool[:3, 1], tool[:3, 2])
                    tool[:3, 3] = tip + offset * turn[:, along]
                    yield _Candidate(
                        f"{side}, fingers along {names[finger]}" + (", tilted" if tilt else ""),
                        tool, float(size[finger]), tight,
                    )  # fmt: skip


def _block(name: str, scene: Scene) -> SceneObject:
    for item in scene.objects:
        if item.name == name:
            if not isinstance(item.shape, Box):
                raise NavigationError(FailureCode.UNSUPPORTED, f"{name} is not a box")
            return item
    raise NavigationError(FailureCode.OBJECT_NOT_FOUND, f"no object {name!r} around the arm")


def _with_motions(
    planner: ArmPlanner,
    candidate: _Candidate,
    target: tuple[str, Scene],
    positions: FloatArray,
    generator: np.random.Generator,
) -> Grasp:
    """Plan the motions of a candidate.

    Raises:
        NavigationError: one of them cannot be planned.
    """
    block, scene = target
    assert scene.width is not None, "the caller has chosen how wide the fingers are open"
    before = candidate.tool.copy()
    before[:3, 3] -= APPROACH * candidate.tool[:3, 2]
    pre_grasp = free_solution(planner, before, scene, positions, generator)
    approach = planner.straight(pre_grasp, candidate.tool, scene)
    held = scene.holding(block, candidate.tool, candidate.width)
    supports = Collisions(planner.model, held).near(block, approach[-1], SUPPORT)
    above = candidate.tool.copy()
    above[2, 3] += LIFT
    lifting = held.touching(*((block, name) for name in supports))
    return Grasp(
        candidate.name,
        pre_grasp,
        approach,
        planner.straight(approach[-1], above, lifting),
        candidate.tool,
        candidate.width,
        scene.width,
        scene,
        lifting,
        held,
        cost=float(np.abs(pre_grasp - positions).max()),
    )


def free_solution(
    planner: ArmPlanner,
    tool: FloatArray,
    scene: Scene,
    positions: FloatArray,
    generator: np.random.Generator,
) -> FloatArray:
    """Return the free positions nearest to those now that bring the tool to a pose.

    Raises:
        NavigationError: there are none.
    """
    found = planner.kinematics.solutions(tool, positions, generator, POSTURES, RESTARTS)
    if not found:
        raise NavigationError(FailureCode.UNREACHABLE, f"the arm cannot reach {place_of(tool)}")
    checks = Collisions(planner.model, scene)
    contacts = [checks.contact(option) for option in found]
    if all(contacts):
        raise ArmBlocked(FailureCode.GOAL_OCCUPIED, f"at {place_of(tool)}", contacts[0])
    return found[contacts.index("")]


def refusal(error: NavigationError) -> str:
    """Return in a few words why a candidate is no good, for counts."""
    if isinstance(error, ArmBlocked):
        return f"blocked ({error.contact})"
    return "out of reach"
