"""Time of a lookup in the tree of frames: `python -m tests.benchmarks.frame_lookup`.

From the base to the hand of `panda_table`, through seven joints, and from one link to another. Each
stamp is new, so that the positions of the joints are interpolated. The fastest of many short
series counts: the others were interrupted.
"""

from __future__ import annotations

import sys
import timeit
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from missions.execution.resources import load_robot
from stack.frames.joint_history import JointHistory
from stack.frames.tree import FrameTree
from stack.streams import stream
from stack.types import JointState
from tests.benchmarks.table import Rows, show

SERIES, LOOKUPS = 100, 200

FRAMES = {"base to hand": ("base", "panda_hand"), "link to link": ("panda_link3", "panda_hand")}


def run(series: int = SERIES) -> Rows:
    """Return a row for each pair of frames."""
    robot, random = load_robot("panda_table", Path()), stream(1, "lookups")
    assert robot.arm is not None
    history = JointHistory(robot.arm.joints)
    for number in range(200):  # 10 s at 20 Hz
        positions = random.uniform(-1.0, 1.0, len(robot.arm.joints))
        still = np.zeros_like(positions)
        history.add(JointState(0.05 * number, positions, still, still))
    tree = FrameTree(history.at)
    for joint in robot.links:
        tree.join(joint)
    rows = []
    for name, (target, source) in FRAMES.items():
        stamps = iter(random.uniform(0.0, 9.9, (series + 1) * LOOKUPS).tolist())

        def look(target: str = target, source: str = source, at: Iterator[float] = stamps) -> None:
            tree.lookup(target, source, next(at))

        look()
        best = min(timeit.repeat(look, number=LOOKUPS, repeat=series)) / LOOKUPS
        rows.append({"lookup": name, "microseconds": round(1e6 * best, 1)})
    return rows


if __name__ == "__main__":
    show("Lookup of frames", run(*map(int, sys.argv[1:])))
