"""Kernel that carries covariances along the shortest paths of a pose graph."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Any

import numpy as np
from numba import f8, i8

from stack.kernel_cache import njit
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def carry_covariances(
    source: int, starts: Any, targets: Any, motions: FloatArray, added: FloatArray,
    costs: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Carry covariances from a node along the paths with the least costs.

    Args:
        source: node.
        starts: (n + 1,) of the outgoing edges of each node.
        targets: (m,) nodes at which the edges end.
        motions: (m, 3) x, y, heading of the target in the frame of the start.
        added: (m, 3, 3) covariances of the motions, frame of the target.
        costs: (m,) of the edges, above 0.

    Returns:
        Covariances (n, 3, 3) of the nodes relative to the source, each in its own frame; and the
        costs (n,) of their paths, inf for nodes that no path reaches.
    """
    count = starts.shape[0] - 1
    found, least = np.zeros((count, 3, 3)), np.full(count, np.inf)
    done = np.zeros(count, np.bool_)
    least[source] = 0.0
    queue = [(0.0, source)]
    back = np.eye(3)
    while queue:
        cost, node = heappop(queue)
        if done[node]:
            continue
        done[node] = True
        for edge in range(starts[node], starts[node + 1]):
            other = targets[edge]
            if done[other] or cost + costs[edge] >= least[other]:
                continue
            least[other] = cost + costs[edge]
            x, y, heading = motions[edge]
            c, s = np.cos(heading), np.sin(heading)
            # The adjoint of the inverse motion: what an error at the start is at the target.
            back[0, 0], back[0, 1], back[0, 2] = c, s, s * x - c * y
            back[1, 0], back[1, 1], back[1, 2] = -s, c, s * y + c * x
            for i in range(3):  # back @ found[node] @ back.T, without SciPy's BLAS
                for j in range(3):
                    total = added[edge, i, j]
                    for k in range(3):
                        for m in range(3):
                            total += back[i, k] * found[node, k, m] * back[j, m]
                    found[other, i, j] = total
            heappush(queue, (least[other], other))
    return found, least


_cells = f8[:, :, ::1]
ENTRY_POINTS = ((carry_covariances, (i8, i8[::1], i8[::1], f8[:, ::1], _cells, f8[::1])),)
"""Kernels of the graph, with the types of their arguments."""
