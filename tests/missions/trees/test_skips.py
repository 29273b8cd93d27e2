"""A skip is a skip everywhere: the table in docs/reference.md, row by row."""

import pytest
from py_trees.common import Status

from tests.missions.mission_fakes import ran


@pytest.fixture
def run(tmp_path):
    return lambda text, **overrides: ran(tmp_path, text, **overrides)


SKIPPED = {
    "inline": "{act: x, when: robot.speed > 9}",
    "in a use": "{use: maybe}",
    "in a one-child sequence": "{sequence: [{act: x, when: robot.speed > 9}]}",
    "in a one-child fallback": "{fallback: [{act: x, when: robot.speed > 9}]}",
    "in a one-child parallel": "{parallel: [{act: x, when: robot.speed > 9}]}",
    "in a round robin": "{round_robin: [{act: x, when: robot.speed > 9}]}",
    "in decorators": "{use: maybe, retry: 2, timeout: 9 s, invert: true, on_failure: continue}",
}
TREES = """
trees:
  maybe: {do: {act: x, when: robot.speed > 9}}
"""


@pytest.fixture(params=SKIPPED.values(), ids=SKIPPED)
def skipped(request):
    trees = TREES if "maybe" in request.param else ""
    return request.param, trees


def test_a_sequence_goes_on(run, skipped):
    node, trees = skipped
    it = run(f"run: {{sequence: [{{act: a}}, {node}, {{act: b}}]}}{trees}")
    assert it.ticks() == ["a starts", "a done", "b starts", "b done"]


@pytest.mark.parametrize("kind", ["fallback", "reactive_fallback"])
def test_a_fallback_tries_the_next_alternative(run, skipped, kind):
    node, trees = skipped
    it = run(f"run: {{{kind}: [{node}, {{act: b}}]}}{trees}")
    assert it.ticks() == ["b starts", "b done"]


def test_a_skip_after_a_failure_leaves_the_failure_of_a_fallback(run, skipped):
    node, trees = skipped
    it = run(f"run: {{fallback: [{{act: a}}, {node}]}}{trees}")
    it.robot.answers["a"] = "f"
    it.ticks()
    assert it.tree.reason == "test > act: NO_WALL a found no wall"


def test_succeed_on_one_is_not_satisfied(run, skipped):
    node, trees = skipped
    it = run(f"run: {{parallel: {{succeed_on: one, do: [{node}, {{act: b}}]}}}}{trees}")
    it.robot.answers["b"] = "rf"
    it.ticks()
    assert it.tree.status is Status.RUNNING
    it.ticks()
    assert it.tree.failure.code == "NO_WALL"


def test_all_means_all_that_are_not_skipped_and_a_number_means_that_number(run):
    node = SKIPPED["inline"]
    assert run(f"run: {{parallel: [{node}, {{act: b}}]}}").ticks() == ["b starts", "b done"]
    it = run(f"run: {{parallel: {{succeed_on: 2, do: [{node}, {node}, {{act: b}}]}}}}")
    it.robot.answers["b"] = "r"
    it.ticks()
    assert it.tree.failure.sentence == "2 children must succeed, but 2 of 3 are skipped"
    assert it.tree.status is Status.FAILURE


def test_a_round_robin_passes_the_turn_on_and_logs_nothing(run, skipped):
    node, trees = skipped
    it = run(f"run: {{round_robin: [{node}, {{act: a}}, {{act: b}}], repeat: 4}}{trees}")
    it.ticks(4)
    assert [entry[0] for entry in it.robot.log if "starts" in entry] == ["a", "b", "a", "b"]
    assert {event["kind"] for event in it.events} == {"node_status"}


def test_a_recover_passes_the_turn_on_and_counts_no_recovery(run, skipped):
    node, trees = skipped
    it = run(f"""
        run:
          act: a
          recover: {{attempts: 3, round_robin: [{node}, {{act: y}}]}}
        {trees.replace(chr(10), chr(10) + "        ")}
        """)
    it.robot.answers["a"] = "f"
    it.ticks(4)
    assert [entry[0] for entry in it.robot.log if "starts" in entry] == list("ayaya")
    assert it.tree.recoveries == 2


def test_a_repeat_counts_it_as_a_run_and_a_retry_does_not_try_again(run, skipped):
    node, trees = skipped
    text = f"run: {{sequence: [{{sequence: [{node}], repeat: 3}}, {{act: b}}]}}{trees}"
    it = run(text)
    it.ticks(2)
    assert it.robot.log == []
    it.ticks()
    assert it.robot.log == ["b starts", "b done"]


def test_a_mission_that_is_skipped_succeeds(run, skipped):
    node, trees = skipped
    it = run(f"run: {{sequence: [{node}]}}{trees}")
    it.ticks()
    assert it.tree.status is Status.SUCCESS


def test_a_loop_whose_items_are_all_skipped_is_skipped(run):
    it = run("""
        run:
          fallback:
            - {for_each: {word: [one, two]}, do: {say: $word, when: robot.speed > 9}}
            - act: b
        """)
    assert it.ticks() == ["b starts", "b done"]


def test_the_row_says_why(run):
    it = run("run: {sequence: [{act: x, when: robot.speed > 9}]}")
    it.ticks()
    assert [(row.kind, row.message) for row in it.tree.rows()][:2] == [
        ("sequence", "skipped"), ("when", "skipped: robot.speed (0) > 9"),
    ]  # fmt: skip
