# mypy: allow-untyped-defs, allow-untyped-calls
"""Compiled loops of the search over poses (x, y, heading) with motion primitives.

The search returns to its caller when it needs larger arrays or an analytic expansion to the goal,
and resumes with the same arrays. `state` (4,) int64 holds the counters that are kept between
calls; NODES to COUNTDOWN are its indices.
"""

from typing import NamedTuple

import numpy as np
from numba import b1, f4, f8, i8, types, u1
from numpy.typing import NDArray

from stack.kernel_cache import njit
from stack.planning.cost_to_go.kernels import UNREACHED
from stack.planning.curves.kernels import _wrap
from stack.planning.kernels import pop, push
from stack.planning.kinematic.contact.kernels import GRID, cell_of, sweep

NODES, WAITING, EXPANDED, COUNTDOWN = 0, 1, 2, 3
"""Indices of `state`: nodes, heap entries, nodes expanded, expansions to the next attempt."""

ATTEMPT, NO_PATH, GROW, LIMIT, SETTLED, STOPPED = 0, 1, 2, 3, 4, 5
"""Why `expand` returned: a node for an analytic expansion, heap empty, arrays full, limit of
expansions reached, nothing left below the cost bound, cancelled."""

CHECKED = 256  # expansions between two checks of the cancel flag
EMPTY = -1
IN_PLACE = 9  # as in `moves`, which imports this module
KEY_OFFSET = 1 << 20  # offset of rows and columns in keys, which keeps them positive


class Moves(NamedTuple):
    """Motion primitives by heading.

    Attributes:
        poses: (headings, moves, samples, 3) along each move in the frame of its start pose;
            the move ends at the last of its `counts` samples.
        counts: (headings, moves) samples in use; 0 if there is no such move.
        costs: (headings, moves) metres, cost of a move on free ground, penalties included.
        kinds: (moves,) int64: steering -1, 0, 1, plus 3 in reverse; or IN_PLACE.
        bins: (k,) heading bin of the k-th part of a full turn, from -pi.
        change: metres added for a change of steering side or of driving direction.
    """

    poses: NDArray[np.float64]
    counts: NDArray[np.int64]
    costs: NDArray[np.float64]
    kinds: NDArray[np.int64]
    bins: NDArray[np.int64]
    change: float


class Target(NamedTuple):
    """Goal, heuristics and start of a query.

    Attributes:
        goal: (3,) pose, map frame.
        to_go: (rows, columns) float32, cost to the goal for a point robot; UNREACHED where
            unreachable.
        horizon: lower bound of the cost to go of cells that `to_go` does not cover.
        table: (2 n + 1, 2 n + 1, m) float32 metres, lengths of the shortest curves to the origin.
        table_step: metres between the positions of the table.
        table_slack: metres by which the table may overestimate.
        ratio: metres to go per expansion between two analytic expansions.
        start: (2,) position where the search began, metres.
        escape: metres from the start within which the footprint may be in contact.
        escape_cost: cost to the goal from the start's nearest free cell.
        contacts: largest value of `contact` allowed within `escape`.
    """

    goal: NDArray[np.float64]
    to_go: NDArray[np.float32]
    horizon: float
    table: NDArray[np.float32]
    table_step: float
    table_slack: float
    ratio: float
    start: NDArray[np.float64]
    escape: float
    escape_cost: float
    contacts: int


class Nodes(NamedTuple):
    """Search nodes; the caller enlarges the arrays.

    Attributes:
        poses: (capacity, 3), map frame.
        costs: (capacity,) float64 cost so far.
        parents: (capacity, 2) int64: previous node and move from it, -1 at the start.
        contacts: (capacity,) int64 of `contact`; above 0 only near a start in contact.
        closed: (capacity,) bool.
        keys: (capacity,) int64.
        slots: (2^n,) int64 hash table of nodes by key, EMPTY where free.
        heap: (m, 2) float64: f and node.
    """

    poses: NDArray[np.float64]
    costs: NDArray[np.float64]
    parents: NDArray[np.int64]
    contacts: NDArray[np.int64]
    closed: NDArray[np.bool_]
    keys: NDArray[np.int64]
    slots: NDArray[np.int64]
    heap: NDArray[np.float64]


@njit(cache=True, nogil=True)
def heading_bin(bins, heading):
    """Return the heading bin of a direction in radians."""
    part = int((_wrap(heading) + np.pi) / (2.0 * np.pi) * bins.size)
    return bins[min(part, bins.size - 1)]


@njit(cache=True, nogil=True)
def estimate(grid, target, x, y, heading, contacts):
    """Cost to go: maximum of the 2D cost-to-go field and the obstacle-free curve length."""
    if contacts > 0:
        return target.escape_cost
    row, column, _ = cell_of(grid, x, y)
    cost = min(target.to_go[row, column], target.horizon)
    if cost >= UNREACHED:
        return cost
    goal_x, goal_y, goal_heading = target.goal
    c, s = np.cos(goal_heading), np.sin(goal_heading)
    forward = c * (x - goal_x) + s * (y - goal_y)
    left = c * (y - goal_y) - s * (x - goal_x)
    half, turns = (target.table.shape[0] - 1) // 2, target.table.shape[2]
    column = int(np.floor(forward / target.table_step + 0.5)) + half
    row = int(np.floor(left / target.table_step + 0.5)) + half
    if 0 <= column <= 2 * half and 0 <= row <= 2 * half:
        turn = int(np.floor((heading - goal_heading) / (2.0 * np.pi) * turns + 0.5)) % turns
        cost = max(cost, target.table[column, row, turn] - target.table_slack)
    return max(cost, np.hypot(x - goal_x, y - goal_y))


@njit(cache=True, nogil=True)
def _slot(slots, keys, key):
    """Return the slot of a key in the hash table, or the free slot for it."""
    mask = slots.size - 1
    mixed = key * 0x9E3779B97F4A7C1
    at = (mixed ^ (mixed >> 29)) & mask
    while slots[at] != EMPTY and keys[slots[at]] != key:
        at = (at + 1) & mask
    return at


@njit(cache=True, nogil=True)
def rehash(slots, keys, count):
    """Insert the first `count` nodes into an empty hash table."""
    for node in range(count):
        slots[_slot(slots, keys, keys[node])] = node


@njit(cache=True, nogil=True)
def add_node(grid, moves, target, nodes, state, pose, cost, parent, move, contacts):
    """Add or update the node of a pose reached at a cost, unless it has a lower cost already."""
    x, y, heading = pose
    resolution = grid.geometry[2]
    column = int(np.floor((x - target.start[0]) / resolution + 0.5)) + KEY_OFFSET
    row = int(np.floor((y - target.start[1]) / resolution + 0.5)) + KEY_OFFSET
    key = (np.int64(row) * (2 * KEY_OFFSET) + column) * 512 + heading_bin(moves.bins, heading)
    slot = _slot(nodes.slots, nodes.keys, key)
    node = nodes.slots[slot]
    if node != EMPTY and (nodes.closed[node] or nodes.costs[node] <= cost):
        return
    to_go = estimate(grid, target, x, y, heading, contacts)
    if to_go >= UNREACHED:
        return
    if node == EMPTY:
        node = state[NODES]
        state[NODES] += 1
        nodes.slots[slot], nodes.keys[node], nodes.closed[node] = node, key, False
    nodes.poses[node, 0], nodes.poses[node, 1], nodes.poses[node, 2] = x, y, heading
    nodes.costs[node], nodes.contacts[node] = cost, contacts
    nodes.parents[node, 0], nodes.parents[node, 1] = parent, move
    push(nodes.heap, state[WAITING], cost + to_go, node)
    state[WAITING] += 1


@njit(cache=True, nogil=True)
def _changes(one, other):
    """Return whether steering changes side or driving changes direction between two kinds."""
    if one == IN_PLACE or other == IN_PLACE:
        return False
    back, other_back = one >= 2, other >= 2
    return back != other_back or (one - 3 * back) * (other - 3 * other_back) < 0


@njit(cache=True, nogil=True)
def _drive(moves, turn, move, pose, driven):
    """Write the poses (n, 3) along a move from a pose (x, y, heading), map frame."""
    x, y, heading = pose
    c, s = np.cos(heading), np.sin(heading)
    for index in range(driven.shape[0]):
        forward, left, bend = moves.poses[turn, move, index]
        driven[index, 0] = x + c * forward - s * left
        driven[index, 1] = y + s * forward + c * left
        driven[index, 2] = heading + bend


@njit(cache=True, nogil=True)
def expand(grid, moves, target, nodes, state, max_expansions, bound, cancelled):
    """A* over poses (Hart, Nilsson and Raphael 1968), until the caller has to act.

    Args:
        grid: costmap and footprint.
        moves: motion primitives.
        target: goal and heuristics.
        nodes: search nodes; changed.
        state: (4,) int64; changed.
        max_expansions: number of expansions after which the search ends with LIMIT.
        bound: the search ends with SETTLED when no remaining f is below this cost.
        cancelled: (1,) uint8; a value other than 0, set by another thread, ends it with STOPPED.

    Returns:
        (ATTEMPT to STOPPED, the node for an analytic expansion or -1).
    """
    count = moves.kinds.size
    driven = np.empty((moves.poses.shape[2], 3))
    while True:
        if state[WAITING] == 0:
            return NO_PATH, -1
        if state[EXPANDED] >= max_expansions:
            return LIMIT, -1
        if state[EXPANDED] % CHECKED == 0 and cancelled[0] != 0:
            return STOPPED, -1
        room = min(nodes.costs.size - state[NODES], nodes.heap.shape[0] - state[WAITING])
        if room <= count:
            return GROW, -1
        f, node = pop(nodes.heap, state[WAITING])
        state[WAITING] -= 1
        if nodes.closed[node]:
            continue
        if f >= bound:
            return SETTLED, -1
        nodes.closed[node] = True
        state[EXPANDED] += 1
        turn = heading_bin(moves.bins, nodes.poses[node, 2])
        before = nodes.parents[node, 1]
        for move in range(count):
            samples = moves.counts[turn, move]
            if samples == 0:
                continue
            _drive(moves, turn, move, nodes.poses[node], driven[:samples])
            allowed = target.contacts if nodes.contacts[node] > 0 else 0
            weight, contacts = sweep(grid, driven[:samples], allowed)
            if weight == 0.0:
                continue
            end = driven[samples - 1]
            away = np.hypot(end[0] - target.start[0], end[1] - target.start[1])
            if contacts > 0 and away > target.escape:
                continue
            cost = nodes.costs[node] + weight * moves.costs[turn, move]
            if before >= 0 and _changes(moves.kinds[before], moves.kinds[move]):
                cost += moves.change
            add_node(
                grid, moves, target, nodes, state, (end[0], end[1], _wrap(end[2])),
                cost, node, move, contacts,
            )  # fmt: skip
        state[COUNTDOWN] -= 1
        if state[COUNTDOWN] <= 0:
            to_go = f - nodes.costs[node]
            state[COUNTDOWN] = int(to_go / target.ratio)
            return ATTEMPT, node


@njit(cache=True, nogil=True)
def trace(moves, nodes, node):
    """Return the poses from the start to a node.

    Returns:
        (poses (n, 3); directions (n,): 1 reached forward, -1 backward, 0 turn in place or start).
    """
    length, at = 1, node
    while nodes.parents[at, 0] >= 0:
        before = nodes.parents[at, 0]
        length += moves.counts[
            heading_bin(moves.bins, nodes.poses[before, 2]), nodes.parents[at, 1]
        ]
        at = before
    poses, directions = np.empty((length, 3)), np.zeros(length, np.int64)
    poses[0] = nodes.poses[at]
    at, fill = node, length
    while nodes.parents[at, 0] >= 0:
        before, move = nodes.parents[at, 0], nodes.parents[at, 1]
        turn = heading_bin(moves.bins, nodes.poses[before, 2])
        samples, kind = moves.counts[turn, move], moves.kinds[move]
        fill -= samples
        _drive(moves, turn, move, nodes.poses[before], poses[fill : fill + samples])
        for index in range(fill, fill + samples):
            poses[index, 2] = _wrap(poses[index, 2])
            directions[index] = 0 if kind == IN_PLACE else (-1 if kind >= 2 else 1)
        at = before
    return poses, directions


_MOVES = types.NamedTuple((f8[:, :, :, ::1], i8[:, ::1], f8[:, ::1], i8[::1], i8[::1], f8), Moves)
_TARGET = types.NamedTuple(
    (f8[::1], f4[:, ::1], f8, f4[:, :, ::1], f8, f8, f8, f8[::1], f8, f8, i8), Target
)
_NODES = types.NamedTuple(
    (f8[:, ::1], f8[::1], i8[:, ::1], i8[::1], b1[::1], i8[::1], i8[::1], f8[:, ::1]), Nodes
)
POSES = (
    (
        add_node,
        (GRID, _MOVES, _TARGET, _NODES, i8[::1], types.UniTuple(f8, 3), f8, i8, i8, i8),
    ),
    (expand, (GRID, _MOVES, _TARGET, _NODES, i8[::1], i8, f8, u1[::1])),
    (rehash, (i8[::1], i8[::1], i8)),
    (trace, (_MOVES, _NODES, i8)),
)
"""Entry points, with the types that planners of poses call them with."""
