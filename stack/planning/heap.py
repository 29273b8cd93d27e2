# mypy: allow-untyped-defs
"""Compiled binary heap of (f, number) in the rows of an array, for the searches.

Numba's caches of its users do not notice a change here: delete them after one.
"""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def push(heap, count, f, number):
    """Add an entry to a binary heap ordered by f, then by number."""
    at = count
    while at > 0:
        above = (at - 1) // 2
        if heap[above, 0] < f or (heap[above, 0] == f and heap[above, 1] <= number):
            break
        heap[at] = heap[above]
        at = above
    heap[at, 0], heap[at, 1] = f, number


@njit(cache=True, nogil=True)
def pop(heap, count):
    """Remove and return the first of `count` heap entries: (f, number)."""
    f, number = heap[0, 0], heap[0, 1]
    last_f, last_number = heap[count - 1, 0], heap[count - 1, 1]
    count -= 1
    at = 0
    while True:
        below = 2 * at + 1
        if below >= count:
            break
        if below + 1 < count and (
            heap[below + 1, 0] < heap[below, 0]
            or (heap[below + 1, 0] == heap[below, 0] and heap[below + 1, 1] < heap[below, 1])
        ):
            below += 1
        if last_f < heap[below, 0] or (last_f == heap[below, 0] and last_number <= heap[below, 1]):
            break
        heap[at] = heap[below]
        at = below
    heap[at, 0], heap[at, 1] = last_f, last_number
    return f, np.int64(number)
