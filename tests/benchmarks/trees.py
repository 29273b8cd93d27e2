"""Cost of one tick: our executor and py_trees' own, on trees of the same shape and leaves."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from types import SimpleNamespace
from typing import Any

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from missions.language.kinds.fallback import Fallback
from missions.language.kinds.parallel import Parallel
from missions.language.kinds.sequence import ReactiveSequence, Sequence
from missions.trees.context import Execution, Record
from missions.trees.leaves import LeafNode
from missions.trees.mission_tree import MissionTree
from stack.documents import Mark
from tests.benchmarks.table import Rows

TICKS, ROUNDS = 20, 15

Shape = str | tuple[str, list[Any]]
"""A leaf (success or running), or (sequence | reactive | fallback | parallel, children)."""


class Leaf(Behaviour):
    """Answers the same on every tick."""

    def __init__(self, name: str, answer: Status) -> None:
        super().__init__(name)
        self.answer = answer

    def update(self) -> Status:
        return self.answer


def shapes() -> dict[str, Shape]:
    """Trees of 1001 nodes that end in a leaf that runs, and a mission of 37."""
    tenth: Shape = ("reactive", ["success"] * 10)
    bushy: list[Shape] = [("reactive", [tenth] * 9) for _ in range(9)]
    bushy += [("reactive", ["success"] * 88 + [("reactive", ["success"] * 9 + ["running"])])]
    deep: Shape = ("reactive", ["success"] * 9 + ["running"])
    for _ in range(99):
        deep = ("reactive", ["success"] * 9 + [deep])
    stop: Shape = ("sequence", ["success", "success", "running"])
    visit: Shape = ("sequence", ["success", "success", ("fallback", ["success", stop]), "success"])
    drive: Shape = ("reactive", ["success", "success", ("fallback", ["failure", stop]), "success"])
    return {
        "bushy, 1001": ("reactive", bushy),
        "wide, 1001": ("reactive", ["success"] * 999 + ["running"]),
        "100 deep, 1001": deep,
        "parallel, 1001": ("parallel", ["running"] * 1000),
        "memory sequence, 1001": ("sequence", ["success"] * 999 + ["running"]),
        "mission, 37": (
            "reactive",
            [
                "success",
                (
                    "parallel",
                    [("sequence", ["success", drive, visit, visit, "success"]), "running"],
                ),
            ],
        ),
    }


def size(shape: Shape) -> int:
    """Number of nodes."""
    return 1 if isinstance(shape, str) else 1 + sum(map(size, shape[1]))


def ours(shape: Shape) -> MissionTree:
    """The shape as the compiler would build it."""
    execution = Execution()
    root = _ours(shape, execution)
    return MissionTree("benchmark", root, execution, {})


def _ours(shape: Shape, execution: Execution) -> Behaviour:
    kind = shape if isinstance(shape, str) else shape[0]
    if isinstance(shape, str):
        node: Any = LeafNode(Leaf(shape, Status[shape.upper()]), execution)
    else:
        children = [_ours(child, execution) for child in shape[1]]
        if kind == "parallel":
            node = Parallel(kind, children, execution, len(children))
        else:
            cls = {
                "sequence": Sequence, "fallback": Fallback,
                "reactive": ReactiveSequence,
            }[kind]  # fmt: skip
            node = cls(kind, children, execution)
    execution.records[id(node)] = Record(node, kind, kind, "", Mark("benchmark"))
    return node  # type: ignore[no-any-return]


def theirs(shape: Shape) -> Behaviour:
    """The shape in py_trees' own classes."""
    if isinstance(shape, str):
        return Leaf(shape, Status[shape.upper()])
    kind, children = shape[0], [theirs(child) for child in shape[1]]
    if kind == "parallel":
        policy = ParallelPolicy.SuccessOnAll(synchronise=True)
        return py_trees.composites.Parallel(kind, policy, children)
    if kind == "fallback":
        return py_trees.composites.Selector(kind, memory=True, children=children)
    return py_trees.composites.Sequence(kind, memory=kind == "sequence", children=children)


def run() -> Rows:
    """Microseconds of a tick in the steady state, the best of some rounds.

    "monitored" is ours with a listener to every change of status and the rows of a snapshot asked
    for after each tick; theirs with a SnapshotVisitor, which notes the status of what was visited.
    """
    rows: Rows = []
    for name, shape in shapes().items():
        plain = py_trees.trees.BehaviourTree(theirs(shape))
        watched = py_trees.trees.BehaviourTree(theirs(shape))
        watched.add_visitor(py_trees.visitors.SnapshotVisitor())
        own, own_watched = _cost(_set_up(shape, None).tick), _cost(_monitored(shape))
        other, other_watched = _cost(plain.tick), _cost(watched.tick)
        rows.append(
            {
                "tree": name, "nodes": size(shape), "ours us": own, "py_trees us": other,
                "times faster": other / own, "ours monitored us": own_watched,
                "py_trees monitored us": other_watched,
                "both monitored": other_watched / own_watched,
                "ours monitored, theirs bare": other / own_watched,
            }
        )  # fmt: skip
    return rows


def _set_up(shape: Shape, listener: Callable[..., None] | None) -> MissionTree:
    tree = ours(shape)
    tree.setup(SimpleNamespace(time=0.0), listener)  # type: ignore[arg-type]
    return tree


def _monitored(shape: Shape) -> Callable[[], None]:
    tree = _set_up(shape, _nobody)
    tick, rows = tree.tick, tree.rows

    def monitored() -> None:
        tick()
        rows()

    return monitored


def _cost(tick: Callable[[], Any]) -> float:
    tick()
    times = []
    for _ in range(ROUNDS):
        began = perf_counter()
        for _ in range(TICKS):
            tick()
        times.append((perf_counter() - began) / TICKS)
    return 1e6 * min(times)


def _nobody(**_: Any) -> None:
    """Listens to no event."""
