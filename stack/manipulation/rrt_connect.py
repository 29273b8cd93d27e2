"""RRT-Connect: two trees of poses that grow towards each other (Kuffner, LaValle, ICRA 2000).

It is written here and not taken from OMPL. OMPL's Python module draws from one generator of the
whole process: two robots that plan at the same time take numbers from each other, and its states
are read number by number in Python. Here the generator is an argument, the limit is a count, and
a motion is checked in one call.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stack.types import FloatArray

RANGE = 0.6
"""Radians of joint space between two nodes at most."""

LEAST = 0.05
"""Radians: shorter motions add no node."""

Advance = Callable[[FloatArray, FloatArray], float]


@dataclass(frozen=True)
class Space:
    """The poses among which a path is searched.

    Attributes:
        lower: (n,) limits.
        upper: (n,) limits.
        advance: returns the share of the straight motion between two poses that is free from its
            start.
    """

    lower: FloatArray
    upper: FloatArray
    advance: Advance


class _Tree:
    """Nodes (m, n) and their parents; roots are their own."""

    def __init__(self, roots: Sequence[FloatArray]) -> None:
        self.size = len(roots)
        self._nodes = np.array(roots, dtype=float)
        self._parents = list(range(self.size))

    def __getitem__(self, node: int) -> FloatArray:
        pose: FloatArray = self._nodes[node]
        return pose

    def nearest(self, pose: FloatArray) -> int:
        offsets = self._nodes[: self.size] - pose
        return int(np.einsum("ij,ij->i", offsets, offsets).argmin())

    def add(self, pose: FloatArray, parent: int) -> int:
        if self.size == len(self._nodes):
            self._nodes = np.vstack((self._nodes, np.empty_like(self._nodes)))
        self._nodes[self.size] = pose
        self._parents.append(parent)
        self.size += 1
        return self.size - 1

    def branch(self, node: int) -> list[FloatArray]:
        """Return the poses from a node to its root."""
        poses = [self._nodes[node]]
        while self._parents[node] != node:
            node = self._parents[node]
            poses.append(self._nodes[node])
        return poses

    def grow(self, pose: FloatArray, advance: Advance, farthest: float) -> tuple[int, bool]:
        """Grow from the nearest node towards a pose.

        Args:
            pose: (n,).
            advance: checks motions.
            farthest: radians that it grows at most.

        Returns:
            The last node, and whether it is the pose.
        """
        node = self.nearest(pose)
        way = pose - self[node]
        length = float(np.linalg.norm(way))
        if length == 0.0:
            return node, True
        begin, wanted = self[node].copy(), min(1.0, farthest / length)
        share = wanted * advance(begin, begin + way * wanted)
        if share * length < min(LEAST, length):
            return node, False
        count = int(np.ceil(share * length / RANGE))
        for part in range(1, count + 1):
            node = self.add(begin + way * (share * part / count), node)
        return node, share == 1.0


def rrt_connect(
    start: FloatArray,
    goals: Sequence[FloatArray],
    space: Space,
    generator: np.random.Generator,
    iterations: int,
) -> FloatArray | None:
    """Return a free path (k, n) from the start to a goal; None: nothing was found.

    Args:
        start: (n,) free pose.
        goals: (n,) free poses; any of them will be reached.
        space: of the poses.
        generator: of the samples.
        iterations: samples at most.
    """
    trees = (_Tree([start]), _Tree(goals))
    for iteration in range(iterations):
        growing, other = trees if iteration % 2 == 0 else trees[::-1]
        size = growing.size
        node, _ = growing.grow(generator.uniform(space.lower, space.upper), space.advance, RANGE)
        if growing.size == size:
            continue
        met, is_reached = other.grow(growing[node].copy(), space.advance, np.inf)
        if is_reached:
            first, second = growing.branch(node), other.branch(met)
            if iteration % 2:
                first, second = second, first
            return np.array([*first[::-1], *second[1:]])
    return None
