"""The search over poses: prepares a place, drives the kernel, and hands back the poses found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stack.components import CancelToken
from stack.geometry.polygons import fill_polygon
from stack.planning.search import StepCosts
from stack.types import LETHAL_COST, UNKNOWN_COST, CostGrid, FloatArray, Footprint, Pose2D

_MORE_AFTER_FOUND = 1.0  # share of the expansions spent so far that go into a cheaper way
_LEAST_MORE = 100
_FIRST_ROOM = 1 << 14  # nodes


@dataclass(frozen=True)
class Drive:
    """Poses to be driven over.

    Attributes:
        poses: (n, 3), map frame.
        ways: (n,) +1 or -1 where a pose was driven to forward or backward, 0 where the robot
            turned in place to it.
        cost: metres, weighed and with all penalties.
    """

    poses: FloatArray
    ways: NDArray[np.int64]
    cost: float


class Shortcut(Protocol):
    """Joins two poses without looking at the map."""

    def __call__(self, start: FloatArray, goal: FloatArray, spacing: float) -> Drive:
        """Poses from start (3,) to goal (3,), the start left out, and the cost on free ground."""
        ...


@dataclass(frozen=True)
class Method:
    """What makes one planner of poses different from another.

    Attributes:
        moves: `kernels.Moves`.
        shortcuts: for attempts to reach the goal in one go; the cheapest clear one counts.
        table: (2 n + 1, 2 n + 1, m) lengths of shortest curves in metres, or one 0.
        table_step: metres.
        table_slack: metres by which the table may say too much.
        ratio: metres to go per expansion between two attempts.
        most: expansions in all.
    """

    moves: Any
    shortcuts: tuple[Shortcut, ...]
    table: NDArray[np.float32]
    table_step: float
    table_slack: float
    ratio: float
    most: int


@dataclass(frozen=True)
class Ground:
    """A costmap for one footprint.

    Attributes:
        costs: map frame.
        place: `kernels.Place`.
    """

    costs: CostGrid
    place: Any

    @staticmethod
    def of(costs: CostGrid, footprint: Footprint, tables: StepCosts) -> Ground:
        """Distances to what the footprint must not touch, and the weight of a metre by cost."""
        import cv2

        from stack.planning.kinematic import kernels

        blocked = costs.cells == LETHAL_COST
        if tables.traverse[UNKNOWN_COST] == 0:
            blocked |= costs.cells == UNKNOWN_COST
        distances = np.full(blocked.shape, np.inf, np.float32)
        if blocked.any():
            clear = np.logical_not(blocked).astype(np.uint8)
            rough = cv2.distanceTransform(clear, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
            # Its last bit depends on where the memory lies; squares of distances are whole numbers.
            distances = np.sqrt(np.rint(np.square(rough))) * np.float32(costs.resolution)
        geometry = np.array([*costs.origin, costs.resolution, costs.resolution * 0.5**0.5])
        place = kernels.Place(
            costs.cells, tables.traverse / float(tables.traverse[0]), distances, geometry,
            fill_polygon(footprint.points, 0.7 * costs.resolution), footprint.circumscribed_radius,
        )  # fmt: skip
        return Ground(costs, place)

    def contacts(self, pose: Pose2D) -> int:
        """How much of the footprint is in contact at a pose; 0 is clear."""
        from stack.planning.kinematic import kernels

        contact: Any = kernels.contact
        return int(contact(self.place, pose.x, pose.y, pose.heading)[1])

    def allowed(self, pose: Pose2D) -> int:
        """What may be in contact while a pose is left: a little more than is at first.

        As it moves, another number of samples falls into the same cells.
        """
        contacts = self.contacts(pose)
        return 0 if contacts == 0 else contacts + contacts // 8 + 2

    def weight(self, poses: FloatArray, contacts: int = 0) -> float:
        """Mean weight of a metre over poses (n, 3); 0 where the footprint cannot pass."""
        from stack.planning.kinematic import kernels

        stretch: Any = kernels.stretch
        return float(stretch(self.place, poses, contacts)[0])


@dataclass(frozen=True)
class Query:
    """One question.

    Attributes:
        seeds: ways to begin: the start itself, or the start turned in place.
        goal: pose to end in.
        field: (rows, columns) float32 cost to the goal for a point.
        horizon: no cell beyond what the field covers costs less.
        escape: metres around the start in which the footprint may be in contact.
        escape_cost: cost to the goal from where that ends.
        contacts: how much of it may be.
        direction: +1 or -1 when the robot comes driving forward or backward, 0 when it stands.
    """

    start: Pose2D
    seeds: list[Drive]
    goal: Pose2D
    field: NDArray[np.float32]
    horizon: float
    escape: float
    escape_cost: float
    contacts: int
    direction: int = 0


@dataclass
class Outcome:
    """What a search came to.

    Attributes:
        drive: from the start to the goal; None when there is none.
        limited: whether it stopped at the limit of expansions.
        expanded: poses expanded.
        reached: (n, 3) poses expanded, for the nearest one.
    """

    drive: Drive | None
    limited: bool
    expanded: int
    reached: FloatArray
    numbers: NDArray[np.int64]
    _search: PoseSearch = field(repr=False)

    def drive_to(self, index: int) -> Drive:
        """The way to the index-th of the poses reached."""
        return self._search.way_to(int(self.numbers[index]))


class PoseSearch:
    """One search over poses."""

    def __init__(self, method: Method, ground: Ground, query: Query) -> None:
        from stack.planning.kinematic import kernels

        self._kernels: Any = kernels
        self._method, self._ground, self._query = method, ground, query
        goal = query.goal
        self._goal = np.array([goal.x, goal.y, goal.heading])
        self._aim = kernels.Aim(
            self._goal, query.field, query.horizon, method.table, method.table_step,
            method.table_slack, method.ratio, np.array([query.start.x, query.start.y]),
            query.escape, query.escape_cost, query.contacts,
        )  # fmt: skip
        self._nodes: Any = self._room(_FIRST_ROOM)
        self._state = np.array([0, 0, 0, 1], dtype=np.int64)
        for seed in query.seeds:
            self._seed(seed)

    def run(self, cancel: CancelToken) -> Outcome:
        """Search until the goal is reached and a little beyond, or nothing is left.

        Raises:
            NavigationError: CANCELLED when the stop is wished for.
        """
        kernels, state = self._kernels, self._state
        best: tuple[int, Drive] | None = None
        bound, most = np.inf, self._method.most
        while True:
            status, node = kernels.expand(
                self._ground.place, self._method.moves, self._aim, self._nodes, state, most, bound,
                cancel.flag,
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
        drive = None if best is None else _joined(self.way_to(best[0]), best[1])
        return self._outcome(drive, status == kernels.LIMIT and best is None)

    def way_to(self, node: int) -> Drive:
        """The poses from the start to a node."""
        poses, ways = self._kernels.trace(self._method.moves, self._nodes, node)
        cost = float(self._nodes.costs[node])
        seeds = [seed for seed in self._query.seeds if np.array_equal(seed.poses[-1], poses[0])]
        if not seeds:
            return Drive(poses, ways, cost)
        before = seeds[0]
        return Drive(np.vstack([before.poses, poses[1:]]), np.append(before.ways, ways[1:]), cost)

    def _seed(self, seed: Drive) -> None:
        x, y, heading = (float(value) for value in seed.poses[-1])
        contacts = self._ground.contacts(Pose2D(x, y, heading))
        self._kernels.reach(
            self._ground.place, self._method.moves, self._aim, self._nodes, self._state,
            (x, y, heading), seed.cost, -1, self._arriving(), contacts,
        )  # fmt: skip

    def _arriving(self) -> int:
        """The move by which the robot comes to the start: straight on, or none."""
        kinds = {1: 0, -1: 3}  # straight forward and backward
        moves = np.flatnonzero(self._method.moves.kinds == kinds.get(self._query.direction, -99))
        return int(moves[0]) if moves.size else -1

    def _attempt(self, node: int) -> Drive | None:
        """From a node to the goal in one go, when the footprint fits all along."""
        before = int(self._nodes.parents[node, 1])
        kind = int(self._method.moves.kinds[before]) if before >= 0 else self._kernels.IN_PLACE
        start = self._nodes.poses[node].copy()
        allowed = self._query.contacts if self._nodes.contacts[node] > 0 else 0
        best: Drive | None = None
        for shortcut in self._method.shortcuts:
            drive = shortcut(start, self._goal, self._ground.costs.resolution)
            weight = self._ground.weight(drive.poses, allowed)
            cost = weight * drive.cost
            if _turns_round(kind, drive.ways):
                cost += self._method.moves.change
            if weight > 0.0 and (best is None or cost < best.cost):
                best = Drive(drive.poses, drive.ways, cost)
        return best

    def _outcome(self, drive: Drive | None, limited: bool) -> Outcome:
        count = int(self._state[self._kernels.NODES])
        done = np.flatnonzero(self._nodes.closed[:count] & (self._nodes.contacts[:count] == 0))
        expanded = int(self._state[self._kernels.EXPANDED])
        return Outcome(drive, limited, expanded, self._nodes.poses[done], done, self)

    def _room(self, size: int) -> Any:
        slots = np.full(4 * size, self._kernels.EMPTY, np.int64)
        return self._kernels.Nodes(
            np.empty((size, 3)), np.empty(size), np.empty((size, 2), np.int64),
            np.empty(size, np.int64), np.zeros(size, np.bool_), np.empty(size, np.int64), slots,
            np.empty((2 * size, 2)),
        )  # fmt: skip

    def _grow(self) -> None:
        """Twice the room, with everything in it."""
        old, count = self._nodes, int(self._state[self._kernels.NODES])
        waiting = int(self._state[self._kernels.WAITING])
        new = self._room(2 * old.costs.size)
        for name in ("poses", "costs", "parents", "contacts", "closed", "keys"):
            getattr(new, name)[:count] = getattr(old, name)[:count]
        new.heap[:waiting] = old.heap[:waiting]
        self._kernels.rehash(new.slots, new.keys, count)
        self._nodes = new


def _turns_round(kind: int, ways: NDArray[np.int64]) -> bool:
    """Whether a drive begins in the other direction than the move before it went."""
    from stack.planning.kinematic import kernels

    if kind == kernels.IN_PLACE or not len(ways):
        return False
    return bool(ways[0] * (-1 if kind >= 2 else 1) < 0)


def _joined(one: Drive, other: Drive) -> Drive:
    return Drive(
        np.vstack([one.poses, other.poses]),
        np.append(one.ways, other.ways),
        one.cost + other.cost,
    )
