"""Uncertainty of keyframes relative to one of them, along the edges of the graph."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stack.mapping.slam.graph import LEAST_INFORMATION, Edge, PoseGraph
from stack.mapping.slam.optimiser import SHARED_ERRORS
from stack.types import FloatArray

LEVER = 10.0
"""Metres: a path is the better, the less a point so far away is moved by its errors."""


class Paths(NamedTuple):
    """The best paths from a keyframe to all others.

    Attributes:
        numbers: (n,) ids of the keyframes, ascending.
        covariances: (n, 3, 3) of x, y and heading of each relative to the first one, own frame.
        costs: (n,) of the paths; inf without one.
    """

    numbers: NDArray[np.int64]
    covariances: FloatArray
    costs: FloatArray


class PathCovariance:
    """Covariances of relative poses, carried along the best path between two keyframes.

    An upper bound: what several paths know together is more.
    """

    def __init__(self, graph: PoseGraph) -> None:
        self._graph = graph
        self._last: Edge | None = None
        self._ends = np.zeros((0, 2), np.int64)
        self._motions, self._added = np.zeros((0, 3)), np.zeros((0, 3, 3))

    def from_keyframe(self, keyframe: int) -> Paths:
        """Return the best paths from a keyframe."""
        from stack.mapping.slam.kernels import carry_covariances

        self._follow()
        numbers = np.array(sorted(self._graph.keyframes), np.int64)
        order = np.argsort(self._ends[:, 0], kind="stable")
        sources = np.searchsorted(numbers, self._ends[order, 0])
        added = self._added[order]
        costs = added[:, 0, 0] + added[:, 1, 1] + LEVER**2 * added[:, 2, 2]
        covariances, costs = carry_covariances(
            int(np.searchsorted(numbers, keyframe)),
            np.searchsorted(sources, np.arange(numbers.size + 1)),
            np.searchsorted(numbers, self._ends[order, 1]), self._motions[order], added, costs,
        )  # fmt: skip
        return Paths(numbers, covariances, costs)

    def _follow(self) -> None:
        """Take the new edges; all of them after some were removed."""
        edges, known = self._graph.edges, len(self._ends) // 2
        if len(edges) < known or (known and edges[known - 1] is not self._last):
            known = 0
        new = edges[known:]
        if not new:
            return
        self._last = new[-1]
        ends = np.array([(e.source, e.target) for e in new], np.int64)
        motions = np.array([(e.relative.x, e.relative.y, e.relative.heading) for e in new])
        information = np.stack([e.information for e in new])
        there = SHARED_ERRORS * np.linalg.inv(information + LEAST_INFORMATION)
        adjoint = _adjoints(motions)
        back = adjoint @ there @ adjoint.transpose(0, 2, 1)
        pairs = (
            (self._ends[: 2 * known], ends, ends[:, ::-1]),
            (self._motions[: 2 * known], motions, _inverted(motions)),
            (self._added[: 2 * known], there, back),
        )
        self._ends, self._motions, self._added = (
            np.concatenate([old, np.stack([one, other], axis=1).reshape(-1, *one.shape[1:])])
            for old, one, other in pairs
        )


def _inverted(motions: FloatArray) -> FloatArray:
    """Return the inverse of motions (n, 3)."""
    x, y, heading = motions.T
    c, s = np.cos(heading), np.sin(heading)
    return np.column_stack([-c * x - s * y, s * x - c * y, -heading])


def _adjoints(motions: FloatArray) -> FloatArray:
    """Return the adjoints (n, 3, 3) of motions (n, 3): an error at the end as one at the start."""
    x, y, heading = motions.T
    c, s = np.cos(heading), np.sin(heading)
    found = np.zeros((len(motions), 3, 3))
    found[:, 0, 0], found[:, 0, 1], found[:, 0, 2] = c, -s, y
    found[:, 1, 0], found[:, 1, 1], found[:, 1, 2] = s, c, -x
    found[:, 2, 2] = 1.0
    return found
