"""Exceptions, failures' paths, events, rows, and py_trees' own view of a compiled mission."""

import py_trees
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from py_trees.common import Status

from stack.errors import InputError
from stack.types import Failure
from tests.missions.mission_fakes import BURST_AT, ran


@pytest.fixture
def run(tmp_path):
    return lambda text, **overrides: ran(tmp_path, text, **overrides)


@pytest.mark.parametrize("where", ["initialise", "update", "terminate"])
def test_an_exception_is_that_nodes_failure_and_the_tree_stays_whole(run, where):
    it = run(f"run: {{fallback: [{{broken: {where}}}, {{act: a}}]}}")
    it.ticks()
    assert it.tree.status is Status.SUCCESS
    assert it.robot.log == ["a starts", "a done"]
    told = [event for event in it.events if event["kind"] == "exception"]
    assert [(event["level"], event["text"]) for event in told] == [
        ("error", f"broken: ValueError: burst in {where} {BURST_AT}")
    ]
    assert len(it.tracebacks) == 1
    assert "scripted_leaves.py" in it.tracebacks[0]


def test_an_exception_while_halting_does_not_keep_the_rest_from_being_halted(run):
    it = run("run: {parallel: [{broken: halt}, {act: a}]}")
    it.robot.answers["a"] = "r"
    it.ticks()
    it.tree.halt()
    assert it.robot.log == ["a starts", "a halted"]
    assert it.tree.status is Status.INVALID


def test_an_exception_is_the_first_cause_when_it_ends_the_mission(run):
    it = run("run: {sequence: [{broken: update, name: camera}], name: shelf}")
    it.ticks()
    assert it.tree.failure == Failure("EXCEPTION", f"ValueError: burst in update {BURST_AT}")
    assert it.tree.reason == (
        f"test > shelf > camera: EXCEPTION ValueError: burst in update {BURST_AT}"
    )


def test_a_failure_of_an_earlier_attempt_is_no_reason_for_a_later_one(run):
    it = run("run: {fails_twice: , retry: 2}")
    it.ticks(3)
    assert it.robot.log == [None, None]
    assert it.tree.status is Status.FAILURE
    assert it.tree.failure.code != "NO_WALL"


def test_a_result_that_is_no_status_is_a_failure(run):
    it = run("run: {broken: status}")
    it.ticks()
    assert it.tree.failure.code == "EXCEPTION"
    assert it.tree.failure.sentence.startswith("update returned a NoneType")


def test_a_failing_setup_is_reported_at_the_position_of_the_node(run):
    with pytest.raises(InputError) as caught:
        run("run: {sequence: [{act: a}, {broken: setup}]}")
    (finding,) = caught.value.findings
    assert (finding.code, finding.mark.line, finding.mark.column) == ("E127", 1, 29)


def test_reading_a_key_that_is_not_set_is_a_failure_without_traceback(run):
    it = run("""
        blackboard: {photo: {type: path, optional: true}}
        run:
          sequence:
            - fallback: [{act: a}, {take_photo: {}, out: {image: $photo}}]
            - say: $photo
        """)
    it.ticks()
    assert it.tree.failure == Failure("NOT_SET", "$photo is read, but nothing has written it yet")
    assert it.tracebacks == []


def test_dividing_by_nothing_is_the_decorators_failure(run):
    it = run("""
        blackboard: {n: {type: int, initial: 0}}
        run: {fallback: [{act: a, when: 1 / $n > 2}, {act: b}]}
        """)
    it.ticks()
    assert it.robot.log == ["b starts", "b done"]


def test_nothing_happens_after_the_end(run):
    it = run("run: {act: a}")
    it.ticks(3)
    assert (it.tree.ticks, it.robot.log) == (1, ["a starts", "a done"])


def test_only_changes_are_emitted_with_the_time_of_the_change_in_the_rows(run):
    it = run("run: {sequence: [{act: a}, {wait: 200 ms}]}")
    it.ticks(4)
    assert it.changes() == [
        "act: idle > success", "wait: idle > running", "sequence: idle > running",
        "wait: running > success", "sequence: running > success",
    ]  # fmt: skip
    sequence, act, wait = it.tree.rows()
    assert (act.since, wait.since, sequence.since) == (0.0, 0.2, 0.2)
    assert [(row.id, row.parent) for row in it.tree.rows()] == [(0, -1), (1, 0), (2, 0)]


def test_a_branch_with_an_equal_outcome_is_no_change(run):
    it = run("run: {reactive: [{sequence: [{act: a}, {act: b}]}, {wait: 1 s}]}")
    it.ticks(5)
    assert [change for change in it.changes() if "act:" in change] == ["act: idle > success"] * 2
    assert it.robot.log.count("a starts") == 5


def test_an_action_halted_and_restarted_in_one_tick_emits_both(run):
    it = run("run: {wait: 100 ms, repeat: 3}")
    it.ticks(3)
    assert [change for change in it.changes() if "wait" in change] == [
        "wait: idle > running", "wait: running > success",
        "wait: success > idle", "wait: idle > running",
    ]  # fmt: skip


def test_rows_are_the_same_tuple_until_something_changes(run):
    it = run("run: {sequence: [{act: a}, {act: b}]}")
    it.robot.answers["b"] = "r"
    before = it.tree.rows()
    assert it.tree.rows() is before
    it.ticks()
    after = it.tree.rows()
    assert after is not before
    it.ticks()
    assert it.tree.rows() is after


def test_idle_rows_show_the_ports(run):
    it = run("run: {navigate_to_pose: $lobby, out: {}}")
    assert it.tree.rows()[0].message == "goal $lobby"


def test_py_trees_own_tools_understand_the_tree(run):
    it = run("run: {sequence: [{fallback: [{act: a}], timeout: 3 s}, {wait: 1 s}]}")
    it.robot.answers["a"] = "f"
    tree = py_trees.trees.BehaviourTree(it.tree.root)
    visitor = py_trees.visitors.SnapshotVisitor()
    tree.add_visitor(visitor)
    tree.tick()
    assert set(visitor.visited.values()) == {Status.FAILURE}
    assert [node.name for node in it.tree.root.iterate()] == [
        "act", "fallback", "timeout 3 s", "wait", "sequence",
    ]  # fmt: skip
    assert "timeout 3 s" in py_trees.display.unicode_tree(it.tree.root)
    assert all(child.parent is it.tree.root for child in it.tree.root.children)


TREES = st.recursive(
    st.sampled_from("abcdef").map(lambda name: f"{{act: {name}}}")
    | st.sampled_from("gh").map(lambda name: f"{{drive: {name}}}"),
    lambda child: st.builds(
        lambda kind, children: f"{{{kind}: [{', '.join(children)}]}}",
        st.sampled_from(
            ["sequence", "reactive", "fallback", "reactive_fallback", "parallel", "round_robin"]
        ),
        st.lists(child, min_size=1, max_size=3),
    )
    | st.builds(
        lambda node, modifier: f"{{sequence: [{node}], {modifier}}}",
        child,
        st.sampled_from(
            [
                "timeout: 300 ms", "retry: 2", "retry: {attempts: 2, delay: 200 ms}", "repeat: 2",
                "on_failure: continue", "while: robot.speed < 1", "when: robot.speed < 1",
                "recover: {attempts: 2, round_robin: [{act: x}]}",
            ]
        ),
    ),
    max_leaves=8,
)  # fmt: skip


@settings(deadline=None, max_examples=120)
@given(node=TREES, scripts=st.lists(st.text("rsf", min_size=1, max_size=4), min_size=9, max_size=9))
def test_every_start_has_one_end_and_halting_leaves_nothing_running(
    tmp_path_factory, node, scripts
):
    try:
        it = ran(tmp_path_factory.mktemp("tree"), f"run: {node}")
    except InputError:
        reject()  # two children of a parallel move the robot
    it.robot.answers.update(zip("abcdefghx", scripts, strict=True))
    for _ in range(6):
        it.ticks()
        assert it.tree.status in (Status.RUNNING, Status.SUCCESS, Status.FAILURE)
        if it.tree.status is not Status.RUNNING:
            assert all(row.status != "running" for row in it.tree.rows())
        assert [row.status for row in it.tree.rows()] == [
            {Status.RUNNING: "running", Status.SUCCESS: "success", Status.FAILURE: "failure"}.get(
                row_node.status, "idle"
            )
            for row_node in preorder(it.tree.root)
        ]
    it.tree.halt()
    assert all(row.status == "idle" for row in it.tree.rows())
    assert sum("starts" in entry for entry in it.robot.log) * 2 == len(it.robot.log)


def preorder(node):
    yield node
    for child in node.children:
        yield from preorder(child)
