"""Choice of a place for the block in the hand: the first one to which all motions are free.

For each pose of the tool the arm moves above it, and lowers the block along a straight line, with
room for fingers that open there. The way back up is the same line, so that it is free as well.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stack.errors import NavigationError
from stack.manipulation.grasps import free_solution, refusal
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.scene import Scene
from stack.types import FailureCode, FloatArray, PlacePlan

SAMPLES = 2_000
"""Of the search for a way above a place: another place is often easier to reach."""

WAYS = 3
"""Places that are given up for want of a way above them: each of these searches takes seconds."""


def place(  # noqa: PLR0913 - what a motion is planned from
    planner: ArmPlanner, tools: Sequence[FloatArray], above: float, width: float, scene: Scene,
    start: FloatArray, generator: np.random.Generator,
) -> PlacePlan:  # fmt: skip
    """Return the way above the first pose of the tool where the block can be put down.

    Args:
        planner: of the arm.
        tools: (4, 4) where the fingers may open, in `base_link`; the best first.
        above: metres over it from which the block is lowered.
        width: of the open fingers, metres.
        scene: with the held block.
        start: (n,) positions of the joints now.
        generator: of inverse kinematics and paths.

    Raises:
        NavigationError: NO_MOTION_PLAN; the sentence says what is wrong with the poses. If nothing
            but one pose was asked for, the error of that pose.
    """
    refused: Counter[str] = Counter()
    without_way = 0
    for tool in tools:
        try:
            over = _over(planner, tool, above, (scene, width), (start, generator))
        except NavigationError as error:
            if len(tools) == 1:
                raise
            refused[refusal(error)] += 1
            continue
        try:
            way = planner.plan(start, [over], scene, generator, SAMPLES)
            return PlacePlan(tool, planner.trajectory(way, scene))
        except NavigationError as error:
            without_way += 1
            if len(tools) == 1 or error.failure.code == FailureCode.START_OCCUPIED:
                raise
            refused["without a way there"] += 1
            if without_way == WAYS:
                break
    words = "; ".join(f"{count} {reason}" for reason, count in refused.most_common(4))
    raise NavigationError(FailureCode.NO_MOTION_PLAN, f"no place for the block: {words}")


def _over(
    planner: ArmPlanner, tool: FloatArray, above: float, target: tuple[Scene, float],
    search: tuple[FloatArray, np.random.Generator],
) -> FloatArray:  # fmt: skip
    """Return positions (n,) above a pose of the tool from which the block can be lowered.

    Raises:
        NavigationError: there are none.
    """
    scene, width = target
    over = tool.copy()
    over[2, 3] += above
    found = free_solution(planner, over, scene, *search)
    planner.straight(found, tool, replace(scene, width=width))
    return found
