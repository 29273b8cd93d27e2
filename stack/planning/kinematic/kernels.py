# mypy: allow-untyped-defs
"""Compiled loops of the search over poses (x, y, heading) with motion primitives.

The search stops whenever it wants something of its caller (more room, an attempt to reach the goal
in one go) and is taken up again with the same arrays. `state` (4,) int64 holds what lives from one
call to the next; its slots are named here.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

NODES, WAITING, EXPANDED, COUNTDOWN = 0, 1, 2, 3
"""Slots of `state`: nodes made, heap entries, nodes expanded, expansions to the next attempt."""

ATTEMPT, NO_WAY, GROW, LIMIT, SETTLED, STOPPED = 0, 1, 2, 3, 4, 5
"""Why `expand` stopped: a node to try the goal from, nothing left, arrays full, enough expanded,
nothing left that is cheaper than the bound, nobody wants the answer any more."""

CHECKED = 256  # expansions between two looks at the wish to stop
UNREACHED = 3.0e38  # cost to go of places that are shut off
EMPTY = -1
AWAY = 1 << 20  # keys count cells from here, so that they stay positive
IN_PLACE = 9


class Place(NamedTuple):
    """The costmap seen by the search.

    Attributes:
        cells: (rows, columns) uint8.
        weights: (256,) what a metre counts by cell cost; 0 for no way.
        distances: (rows, columns) float32 metres from a cell's middle to the nearest lethal one.
        geometry: (4,) origin x and y, resolution, half a cell's diagonal; metres.
        samples: (n, 2) points on and in the footprint, base frame.
        reach: circumscribed radius, metres.
    """

    cells: NDArray[np.uint8]
    weights: NDArray[np.float64]
    distances: NDArray[np.float32]
    geometry: NDArray[np.float64]
    samples: NDArray[np.float64]
    reach: float


class Moves(NamedTuple):
    """Motion primitives by heading.

    Attributes:
        poses: (headings, moves, samples, 3) along each move in the frame of the pose before;
            the last of `counts` is where it ends.
        counts: (headings, moves) samples in use; 0 where there is no such move.
        costs: (headings, moves) metres that a move counts on free ground, penalties included.
        kinds: (moves,) int64: steering -1, 0, 1, plus 3 in reverse; IN_PLACE: on the spot.
        bins: (k,) heading number by k-th part of a turn, from -pi.
        change: metres that a change of steering side or of direction counts.
    """

    poses: NDArray[np.float64]
    counts: NDArray[np.int64]
    costs: NDArray[np.float64]
    kinds: NDArray[np.int64]
    bins: NDArray[np.int64]
    change: float


class Aim(NamedTuple):
    """Where the search goes.

    Attributes:
        goal: (3,) pose.
        to_go: (rows, columns) float32, cost to the goal for a point; UNREACHED where shut off.
        horizon: no cell beyond what `to_go` covers costs less.
        table: (2 n + 1, 2 n + 1, m) float32 metres of the shortest curves to the origin.
        table_step: metres between the places of the table.
        table_slack: metres by which the table may say too much.
        ratio: metres to go per expansion between two attempts to reach the goal in one go.
        start: (2,) where the search began.
        escape: metres from there within which the footprint may touch something.
        escape_cost: cost to the goal from the place where that ends.
        contacts: what `contact` may count there.
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
    """What was reached; grows.

    Attributes:
        poses: (capacity, 3).
        costs: (capacity,) float64 so far.
        parents: (capacity, 2) int64: node before and move from it, -1 at the start.
        contacts: (capacity,) int64 of `contact`; above 0 only near a start that touches something.
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
def contact(place, x, y, heading):
    """(weight of a metre here, footprint samples in contact, one more where the middle has no way).

    Off the grid more samples are in contact than there are.
    """
    rows, columns = place.cells.shape
    origin_x, origin_y, resolution, slack = place.geometry
    column = int(np.floor((x - origin_x) / resolution))
    row = int(np.floor((y - origin_y) / resolution))
    if not (0 <= row < rows and 0 <= column < columns):
        return 0.0, place.samples.shape[0] + 2
    weight = place.weights[place.cells[row, column]]
    touching = 1 if weight == 0.0 else 0
    if place.distances[row, column] > place.reach + 2.0 * slack:
        return weight, touching
    cosine, sine = np.cos(heading), np.sin(heading)
    for sample in range(place.samples.shape[0]):
        forward, left = place.samples[sample, 0], place.samples[sample, 1]
        column = int(np.floor((x + cosine * forward - sine * left - origin_x) / resolution))
        row = int(np.floor((y + sine * forward + cosine * left - origin_y) / resolution))
        if 0 <= row < rows and 0 <= column < columns and place.distances[row, column] == 0.0:
            touching += 1
    return weight, touching


@njit(cache=True, nogil=True)
def stretch(place, poses, contacts):
    """Drive the footprint over poses.

    Args:
        place: costmap.
        poses: (n, 3), map frame.
        contacts: what `contact` may count; nothing any more after the first clear pose.

    Returns:
        (mean weight of a metre, or 0 where the footprint cannot pass; contacts at the last pose).
    """
    total, touching = 0.0, contacts
    for index in range(poses.shape[0]):
        weight, touching = contact(place, poses[index, 0], poses[index, 1], poses[index, 2])
        if touching > contacts:
            return 0.0, touching
        total += max(weight, place.weights[0])
        if touching == 0:
            contacts = 0
    return total / max(poses.shape[0], 1), touching


@njit(cache=True, nogil=True)
def _wrap(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@njit(cache=True, nogil=True)
def heading_bin(bins, heading):
    """Number of the heading that a direction counts as."""
    part = int((_wrap(heading) + np.pi) / (2.0 * np.pi) * bins.size)
    return bins[min(part, bins.size - 1)]


@njit(cache=True, nogil=True)
def estimate(place, aim, x, y, heading, contacts):
    """Cost to go: around obstacles as a point, or over open floor with the turning radius."""
    if contacts > 0:
        return aim.escape_cost
    origin_x, origin_y, resolution, _ = place.geometry
    column = int(np.floor((x - origin_x) / resolution))
    row = int(np.floor((y - origin_y) / resolution))
    cost = min(aim.to_go[row, column], aim.horizon)
    if cost >= UNREACHED:
        return cost
    goal_x, goal_y, goal_heading = aim.goal
    c, s = np.cos(goal_heading), np.sin(goal_heading)
    forward = c * (x - goal_x) + s * (y - goal_y)
    left = c * (y - goal_y) - s * (x - goal_x)
    half, turns = (aim.table.shape[0] - 1) // 2, aim.table.shape[2]
    column = int(np.floor(forward / aim.table_step + 0.5)) + half
    row = int(np.floor(left / aim.table_step + 0.5)) + half
    if 0 <= column <= 2 * half and 0 <= row <= 2 * half:
        turn = int(np.floor((heading - goal_heading) / (2.0 * np.pi) * turns + 0.5)) % turns
        cost = max(cost, aim.table[column, row, turn] - aim.table_slack)
    return max(cost, np.hypot(x - goal_x, y - goal_y))


@njit(cache=True, nogil=True)
def _push(heap, count, f, node):
    """Add an entry to a binary heap ordered by f, then by node."""
    at = count
    while at > 0:
        above = (at - 1) // 2
        if heap[above, 0] < f or (heap[above, 0] == f and heap[above, 1] <= node):
            break
        heap[at] = heap[above]
        at = above
    heap[at, 0], heap[at, 1] = f, node


@njit(cache=True, nogil=True)
def _pop(heap, count):
    """Take the first entry off the heap of `count` entries: (f, node)."""
    f, node = heap[0, 0], heap[0, 1]
    last_f, last_node = heap[count - 1, 0], heap[count - 1, 1]
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
        if last_f < heap[below, 0] or (last_f == heap[below, 0] and last_node <= heap[below, 1]):
            break
        heap[at] = heap[below]
        at = below
    heap[at, 0], heap[at, 1] = last_f, last_node
    return f, int(node)


@njit(cache=True, nogil=True)
def _slot(slots, keys, key):
    """Where a key is in the hash table, or would go."""
    mask = slots.size - 1
    mixed = key * 0x9E3779B97F4A7C1
    at = (mixed ^ (mixed >> 29)) & mask
    while slots[at] != EMPTY and keys[slots[at]] != key:
        at = (at + 1) & mask
    return at


@njit(cache=True, nogil=True)
def rehash(slots, keys, count):
    """Enter the first nodes into an empty, larger hash table."""
    for node in range(count):
        slots[_slot(slots, keys, keys[node])] = node


@njit(cache=True, nogil=True)
def reach(place, moves, aim, nodes, state, pose, cost, parent, move, contacts):
    """Enter a pose that was reached at a cost, unless it is known at a lower one."""
    x, y, heading = pose
    resolution = place.geometry[2]
    column = int(np.floor((x - aim.start[0]) / resolution + 0.5)) + AWAY
    row = int(np.floor((y - aim.start[1]) / resolution + 0.5)) + AWAY
    key = (np.int64(row) * (2 * AWAY) + column) * 512 + heading_bin(moves.bins, heading)
    slot = _slot(nodes.slots, nodes.keys, key)
    node = nodes.slots[slot]
    if node != EMPTY and (nodes.closed[node] or nodes.costs[node] <= cost):
        return
    to_go = estimate(place, aim, x, y, heading, contacts)
    if to_go >= UNREACHED:
        return
    if node == EMPTY:
        node = state[NODES]
        state[NODES] += 1
        nodes.slots[slot], nodes.keys[node], nodes.closed[node] = node, key, False
    nodes.poses[node, 0], nodes.poses[node, 1], nodes.poses[node, 2] = x, y, heading
    nodes.costs[node], nodes.contacts[node] = cost, contacts
    nodes.parents[node, 0], nodes.parents[node, 1] = parent, move
    _push(nodes.heap, state[WAITING], cost + to_go, node)
    state[WAITING] += 1


@njit(cache=True, nogil=True)
def _changes(one, other):
    """Whether steering goes from side to side or driving from forward to backward."""
    if one == IN_PLACE or other == IN_PLACE:
        return False
    back, other_back = one >= 2, other >= 2
    return back != other_back or (one - 3 * back) * (other - 3 * other_back) < 0


@njit(cache=True, nogil=True)
def expand(place, moves, aim, nodes, state, most, bound, stop):
    """Best-first search (A*, Hart, Nilsson and Raphael 1968) over poses, until something is up.

    Args:
        place: costmap and footprint.
        moves: motion primitives.
        aim: goal and heuristics.
        nodes: what was reached; changed.
        state: (4,) int64; changed.
        most: expansions after which to stop.
        bound: stops when nothing left may cost less in all.
        stop: (1,) uint8, set to anything but 0 by another thread to have it STOPPED.

    Returns:
        (why it stopped, the node to try the goal from or -1).
    """
    count = moves.kinds.size
    driven = np.empty((moves.poses.shape[2], 3))
    while True:
        if state[WAITING] == 0:
            return NO_WAY, -1
        if state[EXPANDED] >= most:
            return LIMIT, -1
        if state[EXPANDED] % CHECKED == 0 and stop[0] != 0:
            return STOPPED, -1
        room = min(nodes.costs.size - state[NODES], nodes.heap.shape[0] - state[WAITING])
        if room <= count:
            return GROW, -1
        f, node = _pop(nodes.heap, state[WAITING])
        state[WAITING] -= 1
        if nodes.closed[node]:
            continue
        if f >= bound:
            return SETTLED, -1
        nodes.closed[node] = True
        state[EXPANDED] += 1
        x, y, heading = nodes.poses[node]
        c, s = np.cos(heading), np.sin(heading)
        turn = heading_bin(moves.bins, heading)
        before = nodes.parents[node, 1]
        for move in range(count):
            samples = moves.counts[turn, move]
            if samples == 0:
                continue
            for index in range(samples):
                forward, left, bend = moves.poses[turn, move, index]
                driven[index, 0] = x + c * forward - s * left
                driven[index, 1] = y + s * forward + c * left
                driven[index, 2] = heading + bend
            allowed = aim.contacts if nodes.contacts[node] > 0 else 0
            weight, contacts = stretch(place, driven[:samples], allowed)
            if weight == 0.0:
                continue
            end = driven[samples - 1]
            away = np.hypot(end[0] - aim.start[0], end[1] - aim.start[1])
            if contacts > 0 and away > aim.escape:
                continue
            cost = nodes.costs[node] + weight * moves.costs[turn, move]
            if before >= 0 and _changes(moves.kinds[before], moves.kinds[move]):
                cost += moves.change
            reach(
                place, moves, aim, nodes, state, (end[0], end[1], _wrap(end[2])),
                cost, node, move, contacts,
            )  # fmt: skip
        state[COUNTDOWN] -= 1
        if state[COUNTDOWN] <= 0:
            to_go = f - nodes.costs[node]
            state[COUNTDOWN] = int(to_go / aim.ratio)
            return ATTEMPT, node


@njit(cache=True, nogil=True)
def trace(moves, nodes, node):
    """Poses from the start to a node.

    Returns:
        (poses (n, 3); ways (n,): 1 driven to forward, -1 backward, 0 turned in place or stood).
    """
    length, at = 1, node
    while nodes.parents[at, 0] >= 0:
        before = nodes.parents[at, 0]
        length += moves.counts[
            heading_bin(moves.bins, nodes.poses[before, 2]), nodes.parents[at, 1]
        ]
        at = before
    poses, ways = np.empty((length, 3)), np.zeros(length, np.int64)
    poses[0] = nodes.poses[at]
    at, fill = node, length
    while nodes.parents[at, 0] >= 0:
        before, move = nodes.parents[at, 0], nodes.parents[at, 1]
        x, y, heading = nodes.poses[before]
        c, s = np.cos(heading), np.sin(heading)
        turn = heading_bin(moves.bins, heading)
        samples, kind = moves.counts[turn, move], moves.kinds[move]
        fill -= samples
        for index in range(samples):
            forward, left, bend = moves.poses[turn, move, index]
            poses[fill + index, 0] = x + c * forward - s * left
            poses[fill + index, 1] = y + s * forward + c * left
            poses[fill + index, 2] = _wrap(heading + bend)
            ways[fill + index] = 0 if kind == IN_PLACE else (-1 if kind >= 2 else 1)
        at = before
    return poses, ways
