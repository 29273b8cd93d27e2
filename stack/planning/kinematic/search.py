"""Search over poses: collision map, kernel calls, analytic expansions and the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.components import CancelToken
from stack.geometry.distance_transform import distances_to_zero
from stack.geometry.polygons import fill_polygon
from stack.planning.kinematic.moves import IN_PLACE, Penalties
from stack.planning.search import StepCosts
from stack.types import LETHAL_COST, UNKNOWN_COST, CostGrid, FloatArray, Footprint, Pose2D

_MORE_AFTER_FOUND = 1.0  # after the first solution, search on for this share of the expansions
_LEAST_MORE = 100
_SHARE_FOR_BETTER = 0.05  # of the expansions, while the robot follows a path that is still free
_INITIAL_CAPACITY = 1 << 14  # nodes

TILE = 5.0
"""Cells on a side of the tiles into which the samples of a footprint are sorted."""


@dataclass(frozen=True)
class PoseDrive:
    """Sequence of poses with driving directions and a cost.

    Attributes:
        poses: (n, 3), map frame.
        directions: (n,) +1 or -1 for a pose reached forward or backward, 0 for a turn in place.
        cost: metres, weighted and with all penalties.
    """

    poses: FloatArray
    directions: NDArray[np.int64]
    cost: float


Shortcut = Callable[[FloatArray, FloatArray, float], PoseDrive]
"""Connects two poses (3,) without a collision check: start, goal and spacing in metres to the poses
without the start, and the cost if free."""


@dataclass(frozen=True)
class SearchMethod:
    """Search method: motion primitives, analytic expansions and heuristic of a pose planner.

    Attributes:
        moves: `kernels.Moves`.
        shortcuts: analytic expansions to the goal; the cheapest clear one is used.
        table: (2 n + 1, 2 n + 1, m) lengths of shortest curves in metres, or a single 0.
        table_step: metres between the positions of the table.
        table_slack: metres by which the table may overestimate.
        ratio: metres to go per expansion between two analytic expansions.
        max_expansions: maximum number of expansions.
        penalties: of the moves and shortcuts.
    """

    moves: Any
    shortcuts: tuple[Shortcut, ...]
    table: NDArray[np.float32]
    table_step: float
    table_slack: float
    ratio: float
    max_expansions: int
    penalties: Penalties


@dataclass(frozen=True)
class CollisionChecker:
    """Collision checker for one costmap and footprint.

    Attributes:
        costs: map frame.
        grid: `contact.kernels.CollisionGrid`.
    """

    costs: CostGrid
    grid: Any

    @staticmethod
    def of(costs: CostGrid, footprint: Footprint, tables: StepCosts) -> CollisionChecker:
        """Compute the distances to lethal cells and the cost of a metre by cell cost."""
        from stack.planning.kinematic.contact import kernels

        blocked = costs.cells == LETHAL_COST
        if tables.traverse[UNKNOWN_COST] == 0:
            blocked |= costs.cells == UNKNOWN_COST
        distances = distances_to_zero(~blocked) * np.float32(costs.resolution)
        geometry = np.array([*costs.origin, costs.resolution, costs.resolution * 0.5**0.5])
        grid = kernels.CollisionGrid(
            costs.cells, tables.traverse / float(tables.traverse[0]), distances, geometry,
            *tiled(fill_polygon(footprint.points, 0.7 * costs.resolution), TILE * costs.resolution),
            footprint.circumscribed_radius,
        )  # fmt: skip
        return CollisionChecker(costs, grid)

    def contacts(self, pose: Pose2D) -> int:
        """Return the number of footprint samples in contact at a pose; 0 is clear."""
        from stack.planning.kinematic.contact import kernels

        contact: Any = kernels.contact
        return int(contact(self.grid, pose.x, pose.y, pose.heading, len(self.grid.samples) + 2)[1])

    def allowed_contacts(self, pose: Pose2D) -> int:
        """Return how many samples may be in contact while the robot leaves a pose.

        A little more than at the pose, since the number of samples in the same cells varies
        during a motion.
        """
        contacts = self.contacts(pose)
        return 0 if contacts == 0 else contacts + contacts // 8 + 2

    def weight(self, poses: FloatArray, contacts: int = 0) -> float:
        """Return the mean cost of a metre over poses (n, 3); 0 if the footprint collides."""
        from stack.planning.kinematic.contact import kernels

        sweep: Any = kernels.sweep
        return float(sweep(self.grid, poses, contacts)[0])

    def judged(self, poses: FloatArray) -> tuple[float, float]:
        """Judge poses (n, 3), whether or not they collide.

        Returns:
            (mean cost of a metre; largest share of the footprint in contact).
        """
        from stack.planning.kinematic.contact import kernels

        contact: Any = kernels.contact
        all_samples, least = len(self.grid.samples), float(self.grid.weights[0])
        found = np.array([contact(self.grid, *pose, all_samples + 2) for pose in poses])
        return float(np.maximum(found[:, 0], least).mean()), float(found[:, 1].max()) / all_samples


def tiled(samples: FloatArray, width: float) -> tuple[FloatArray, FloatArray]:
    """Sort samples into square tiles, so that tiles far from obstacles are checked at once.

    Args:
        samples: (n, 2) base frame, metres.
        width: of a tile, metres.

    Returns:
        (samples, tiles) as in `contact.kernels.CollisionGrid`.
    """
    tile = np.floor((samples - samples.min(axis=0)) / width)
    order = np.lexsort(tile.T)
    samples, tile = np.ascontiguousarray(samples[order]), tile[order]
    ends = np.append(np.flatnonzero((tile[1:] != tile[:-1]).any(axis=1)) + 1, len(samples))
    rows = []
    for part, end in zip(np.split(samples, ends[:-1]), ends, strict=True):
        middle = 0.5 * (part.min(axis=0) + part.max(axis=0))
        rows.append((*middle, np.hypot(*(part - middle).T).max(), end))
    return samples, np.array(rows, dtype=np.float64)


@dataclass(frozen=True)
class PoseQuery:
    """Query of a search.

    Attributes:
        seeds: initial drives: the start itself, or the start turned in place.
        target: `kernels.Target`.
        direction: +1 or -1 if the robot arrives driving forward or backward, 0 at standstill.
        below: only drives that cost less are of use; a search for them is short.
    """

    seeds: list[PoseDrive]
    target: Any
    direction: int = 0
    below: float = np.inf


@dataclass
class SearchOutcome:
    """Result of a search.

    Attributes:
        drive: from the start to the goal; None if none was found.
        limited: whether the search stopped at the limit of expansions without a drive.
        expanded: number of poses expanded.
        reached: (n, 3) expanded poses that are clear of contact.
        numbers: (n,) their nodes.
    """

    drive: PoseDrive | None
    limited: bool
    expanded: int
    reached: FloatArray
    numbers: NDArray[np.int64]
    _search: KinematicSearch = field(repr=False)

    def drive_to(self, index: int) -> PoseDrive:
        """Return the drive to `reached[index]`."""
        return self._search.drive_to(int(self.numbers[index]))


class KinematicSearch:
    """One search over poses."""

    def __init__(self, method: SearchMethod, checker: CollisionChecker, query: PoseQuery) -> None:
        from stack.planning.kinematic import kernels

        self._kernels: Any = kernels
        self._method, self._checker, self._query = method, checker, query
        self._nodes: Any = self._allocate(_INITIAL_CAPACITY)
        self._state = np.array([0, 0, 0, 1], dtype=np.int64)
        for seed in query.seeds:
            self._seed(seed)

    def run(self, cancel: CancelToken) -> SearchOutcome:
        """Search until a drive is found and refined, no node is left, or the limit is reached.

        Raises:
            NavigationError: CANCELLED when the cancel token is set.
        """
        kernels, state = self._kernels, self._state
        best: tuple[int, PoseDrive] | None = None
        bound, most = self._query.below, self._method.max_expansions
        if bound < np.inf:
            most = max(_LEAST_MORE, int(_SHARE_FOR_BETTER * most))
        while True:
            status, node = kernels.expand(
                self._checker.grid, self._method.moves, self._query.target, self._nodes, state,
                most, bound, cancel.flag,
            )  # fmt: skip
            cancel.check()
            if status == kernels.GROW:
                self._grow()
                continue
            if status != kernels.ATTEMPT:
                break
            rest = self._attempt(int(node))
            if rest is None:
                continue
            total = float(self._nodes.costs[node]) + rest.cost
            if total < bound:
                more = max(_LEAST_MORE, int(_MORE_AFTER_FOUND * state[kernels.EXPANDED]))
                if best is None:
                    most = min(most, int(state[kernels.EXPANDED]) + more)
                best, bound = (int(node), rest), total
        drive = None if best is None else _joined(self.drive_to(best[0]), best[1])
        return self._outcome(drive, status == kernels.LIMIT and best is None)

    def drive_to(self, node: int) -> PoseDrive:
        """Return the drive from the start to a node."""
        poses, directions = self._kernels.trace(self._method.moves, self._nodes, node)
        cost = float(self._nodes.costs[node])
        seeds = [seed for seed in self._query.seeds if np.array_equal(seed.poses[-1], poses[0])]
        if not seeds:
            return PoseDrive(poses, directions, cost)
        before = seeds[0]
        joined = np.append(before.directions, directions[1:])
        return PoseDrive(np.vstack([before.poses, poses[1:]]), joined, cost)

    def _seed(self, seed: PoseDrive) -> None:
        x, y, heading = (float(value) for value in seed.poses[-1])
        contacts = self._checker.contacts(Pose2D(x, y, heading))
        self._kernels.add_node(
            self._checker.grid, self._method.moves, self._query.target, self._nodes, self._state,
            (x, y, heading), seed.cost, -1, self._arrival_move(), contacts,
        )  # fmt: skip

    def _arrival_move(self) -> int:
        """Return the straight move by which the robot arrives at the start, or -1 for none."""
        kinds = {1: 0, -1: 3}  # straight forward and backward
        moves = np.flatnonzero(self._method.moves.kinds == kinds.get(self._query.direction, -99))
        return int(moves[0]) if moves.size else -1

    def _attempt(self, node: int) -> PoseDrive | None:
        """Return the cheapest collision-free analytic expansion from a node, or None."""
        before = int(self._nodes.parents[node, 1])
        kind = int(self._method.moves.kinds[before]) if before >= 0 else IN_PLACE
        start = self._nodes.poses[node].copy()
        allowed = self._query.target.contacts if self._nodes.contacts[node] > 0 else 0
        best: PoseDrive | None = None
        for shortcut in self._method.shortcuts:
            drive = shortcut(start, self._query.target.goal, self._checker.costs.resolution)
            weight = self._checker.weight(drive.poses, allowed)
            cost = weight * drive.cost
            if _reverses(kind, drive.directions):
                cost += self._method.moves.change
            if weight > 0.0 and (best is None or cost < best.cost):
                best = PoseDrive(drive.poses, drive.directions, cost)
        return best

    def _outcome(self, drive: PoseDrive | None, limited: bool) -> SearchOutcome:
        count = int(self._state[self._kernels.NODES])
        done = np.flatnonzero(self._nodes.closed[:count] & (self._nodes.contacts[:count] == 0))
        expanded = int(self._state[self._kernels.EXPANDED])
        return SearchOutcome(drive, limited, expanded, self._nodes.poses[done], done, self)

    def _allocate(self, size: int) -> Any:
        slots = np.full(4 * size, self._kernels.EMPTY, np.int64)
        return self._kernels.Nodes(
            np.empty((size, 3)), np.empty(size), np.empty((size, 2), np.int64),
            np.empty(size, np.int64), np.zeros(size, np.bool_), np.empty(size, np.int64), slots,
            np.empty((2 * size, 2)),
        )  # fmt: skip

    def _grow(self) -> None:
        """Double the capacity and copy all nodes."""
        old, count = self._nodes, int(self._state[self._kernels.NODES])
        waiting = int(self._state[self._kernels.WAITING])
        new = self._allocate(2 * old.costs.size)
        before, after = old._asdict(), new._asdict()
        for name in ("poses", "costs", "parents", "contacts", "closed", "keys"):
            after[name][:count] = before[name][:count]
        new.heap[:waiting] = old.heap[:waiting]
        self._kernels.rehash(new.slots, new.keys, count)
        self._nodes = new


def _reverses(kind: int, directions: NDArray[np.int64]) -> bool:
    """Return whether a drive begins in the opposite direction of the move before it."""
    if kind == IN_PLACE or not len(directions):
        return False
    return bool(directions[0] * (-1 if kind >= 2 else 1) < 0)


def _joined(one: PoseDrive, other: PoseDrive) -> PoseDrive:
    return PoseDrive(
        np.vstack([one.poses, other.poses]),
        np.append(one.directions, other.directions),
        one.cost + other.cost,
    )
