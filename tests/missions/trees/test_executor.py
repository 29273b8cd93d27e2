"""Direct calls against py_trees' own ticking, on random trees of the nodes that both have.

One difference is meant. py_trees' Parallel ticks every child and then looks whether one failed;
ours, as BehaviorTree.CPP's, is decided by the first failure: children behind it get no turn, so
that no action starts that would be halted at once. Parallels whose children can fail are therefore
compared with `DecidesEarly`, py_trees' Parallel with exactly that changed.
"""

import random

import py_trees
import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from missions.language.kinds.fallback import Fallback, ReactiveFallback
from missions.language.kinds.parallel import Parallel
from missions.language.kinds.sequence import ReactiveSequence, Sequence
from missions.trees import attempts, decorators
from missions.trees.context import WORDS as WORD_OF
from missions.trees.context import Execution, Record
from missions.trees.leaves import LeafNode
from missions.trees.mission_tree import MissionTree
from stack.documents import Mark

WORDS = {"s": Status.SUCCESS, "f": Status.FAILURE, "r": Status.RUNNING}
TREES, TICKS = 1500, 25


class Scripted(Behaviour):
    """Answers as its script says, over and over, and notes what is called.

    Its message changes every second turn, also when its status does not.
    """

    def __init__(self, name, script, log):
        super().__init__(name)
        self.script, self.log, self.turn, self.active = script, log, 0, False

    def initialise(self):
        self.active = True
        self.log.append((self.name, "initialise"))

    def update(self):
        self.turn += 1
        self.feedback_message = f"turn {self.turn // 2}"
        return WORDS[self.script[self.turn % len(self.script)]]

    def terminate(self, new_status):
        # py_trees tells finished leaves again that they are over; treepilot does not.
        if self.active:
            self.active = False
            self.log.append((self.name, "terminate", new_status))


class DecidesEarly(py_trees.composites.Parallel):
    """py_trees' Parallel, but for one thing: the first failure of a tick ends the round."""

    def tick(self):
        if self.status is not Status.RUNNING:
            for child in self.children:
                child.stop(Status.INVALID)
        failed = False
        for child in self.children:
            if child.status is Status.SUCCESS or failed:
                continue
            yield from child.tick()
            failed = child.status is Status.FAILURE
        succeeded = all(child.status is Status.SUCCESS for child in self.children)
        status = Status.SUCCESS if succeeded else Status.RUNNING
        status = Status.FAILURE if failed else status
        if status is not Status.RUNNING:
            self.stop(status)
        self.status = status
        yield self


def random_tree(draw, depth, letters="srf"):
    """A leaf's script, or (kind, children)."""
    if depth == 0 or draw.random() < 0.3:
        return "".join(draw.choice(letters) for _ in range(draw.randint(1, 5)))
    kind = draw.choice(
        ["sequence", "fallback", "reactive", "reactive_fallback", "parallel", "parallel that fails",
         "retry", "repeat", "on_failure"]
    )  # fmt: skip
    if kind in ("retry", "repeat", "on_failure"):
        return kind, [random_tree(draw, depth - 1, letters)]
    if kind == "parallel":
        return kind, [random_tree(draw, 0, "sr") for _ in range(draw.randint(1, 3))]
    return kind, [random_tree(draw, depth - 1, letters) for _ in range(draw.randint(1, 3))]


class Builder:
    """Builds one shape in both kinds of nodes; names count up in the same order."""

    def __init__(self, execution=None):
        self.execution, self.log, self.count = execution, [], 0

    def build(self, shape):
        self.count += 1
        name = str(self.count)
        if isinstance(shape, str):
            node = Scripted(name, shape, self.log)
            if self.execution is not None:
                node = LeafNode(node, self.execution)
        else:
            children = [self.build(child) for child in shape[1]]
            make = self.theirs if self.execution is None else self.ours
            node = make(shape[0], name, children)
            node.name = name
        if self.execution is not None:
            record = Record(node, "node", name, "", Mark("test"))
            self.execution.records[id(node)] = record
        return node

    def theirs(self, kind, name, children):
        one = children[0]
        made = {
            "sequence": lambda: py_trees.composites.Sequence(name, True, children),
            "reactive": lambda: py_trees.composites.Sequence(name, False, children),
            "fallback": lambda: py_trees.composites.Selector(name, True, children),
            "reactive_fallback": lambda: py_trees.composites.Selector(name, False, children),
            "parallel": lambda: py_trees.composites.Parallel(
                name, ParallelPolicy.SuccessOnAll(synchronise=True), children
            ),
            "parallel that fails": lambda: DecidesEarly(
                name, ParallelPolicy.SuccessOnAll(synchronise=True), children
            ),
            "retry": lambda: py_trees.decorators.Retry(name, one, 2),
            "repeat": lambda: py_trees.decorators.Repeat(name, one, 2),
            "on_failure": lambda: py_trees.decorators.FailureIsSuccess(name, one),
        }
        return made[kind]()

    def ours(self, kind, name, children):
        one, execution = children[0], self.execution
        made = {
            "sequence": lambda: Sequence(name, children, execution),
            "reactive": lambda: ReactiveSequence(name, children, execution),
            "fallback": lambda: Fallback(name, children, execution),
            "reactive_fallback": lambda: ReactiveFallback(name, children, execution),
            "parallel": lambda: Parallel(name, children, execution, len(children)),
            "parallel that fails": lambda: Parallel(name, children, execution, len(children)),
            "retry": lambda: attempts.Retry(
                name, one, execution, attempts.Attempts(lambda: 2), lambda: 0.0
            ),
            "repeat": lambda: decorators.Repeat(name, one, execution, lambda: 2),
            "on_failure": lambda: decorators.OnFailure(name, one, execution),
        }
        return made[kind]()


class Clock:
    """A robot that has nothing but the time."""

    time = 0.0


def answers(node, execution):
    """What each node answered in a tick, in order, also where it was halted later in that tick."""
    visited = execution.visited = []
    node.execute_tick()
    execution.visited = None
    return [(node.name, status) for node, status in visited]


def follow(told, event):
    """Keep the status of every node from nothing but the events; none may be left out."""
    if event["kind"] == "node_status":
        fields = event["fields"]
        assert fields["from"] == told.get(fields["node"], "idle") != fields["to"]
        told[fields["node"]] = fields["to"]


def compare(shape):
    """Tick both 25 times, beginning again after each end."""
    execution = Execution()
    ours, theirs = Builder(execution), Builder()
    tree = MissionTree("test", ours.build(shape), execution, {})
    told = {}
    tree.setup(Clock(), lambda **event: follow(told, event))
    root = theirs.build(shape)
    for number in range(TICKS):
        mine = answers(tree.root, execution)
        other = [(node.name, node.status) for node in root.tick()]
        assert mine == other, (shape, number)
        assert ours.log == theirs.log, (shape, number)
        assert tree.rows() == tuple(record.as_row() for record in tree.records)
        assert told == {
            record.id: WORD_OF[record.node.status]
            for record in tree.records
            if record.id in told or record.node.status is not Status.INVALID
        }
        running = {node.name for node in tree.root.iterate() if node.status is Status.RUNNING}
        assert running == {node.name for node in root.iterate() if node.status is Status.RUNNING}
    tree.halt()
    root.stop(Status.INVALID)
    assert ours.log == theirs.log, shape


@pytest.mark.slow
def test_statuses_visits_and_calls_equal_py_trees_own():
    draw = random.Random(7)
    for _ in range(TREES):
        compare(random_tree(draw, 3))


def visits(builder, shape):
    node, execution = builder.build(shape), builder.execution
    if execution is None:
        return [(visited.name, visited.status) for visited in node.tick()], builder.log
    MissionTree("test", node, execution, {}).setup(Clock())
    return answers(node, execution), builder.log


def test_a_parallel_is_decided_by_the_first_failure_and_starts_nothing_behind_it():
    """The one difference from py_trees, side by side."""
    shape = ("parallel that fails", ["r", "f", "r"])
    decided = [("2", Status.RUNNING), ("3", Status.FAILURE), ("1", Status.FAILURE)]
    halted = [
        ("2", "initialise"), ("3", "initialise"), ("3", "terminate", Status.FAILURE),
        ("2", "terminate", Status.INVALID),
    ]  # fmt: skip
    assert visits(Builder(Execution()), shape) == (decided, halted)
    assert visits(Builder(), shape) == (decided, halted)
    theirs, calls = visits(Builder(), ("parallel", ["r", "f", "r"]))
    assert theirs == [*decided[:2], ("4", Status.RUNNING), decided[2]]
    assert ("4", "initialise") in calls, "py_trees starts what it halts in the same tick"
