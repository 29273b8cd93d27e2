"""Failures are found at the nodes where they began, in runs of this version and of older ones."""

import pytest

from missions.inspection.page.failed_nodes import failures_of
from missions.inspection.trace_model import Trace, _tree
from stack.telemetry.records import Event

ROWS = [
    [0, -1, "sequence", "patrol", "m.yaml:6"],
    [1, 0, "timeout", "timeout 9 s", "m.yaml:7"],
    [2, 1, "navigate_to_pose", "to the desk", "m.yaml:7"],
]
BEGUN = [(2, "idle", "running", 0.0, {}), (1, "idle", "running", 0.0, {}),
         (0, "idle", "running", 0.0, {})]  # fmt: skip


def why(code, origin, *, is_new):
    return {"code": code, **({"origin": origin} if is_new else {})}


def trace_of(changes):
    tree = Event(0, 0, 0.0, "info", "tree", "tree", "3 nodes", {"rows": ROWS})
    events = [tree]
    for node, before, to, time, fields in changes:
        told = {"node": node, "name": "", "from": before, "to": to, "message": "late", **fields}
        events.append(Event(len(events), 0, time, "info", "tree", "node_status", "", told))
    return Trace((_tree(tree),), tuple(events))


@pytest.mark.parametrize("is_new", [True, False])
def test_a_time_limit_fails_without_a_leaf_that_fails(is_new):
    ended = why("TIMED_OUT", 1, is_new=is_new)
    found = failures_of(
        trace_of([
            *BEGUN, (2, "running", "idle", 9.0, {}), (1, "running", "failure", 9.0, ended),
            (0, "running", "failure", 9.0, ended),
        ]),
        {"m.yaml:7": "- navigate_to_pose: {goal: $desk}"}.get,
    )  # fmt: skip
    (failed,) = found.every
    assert failed == found.last
    assert (failed.name, failed.code, failed.begin, failed.time) == (
        "timeout 9 s",
        "TIMED_OUT",
        0,
        9,
    )
    assert (failed.path, failed.line) == (("patrol",), "- navigate_to_pose: {goal: $desk}")


@pytest.mark.parametrize("is_new", [True, False])
def test_the_nodes_above_a_leaf_do_not_fail_by_themselves(is_new):
    ended = why("NO_VALID_PATH", 2, is_new=is_new)
    found = failures_of(
        trace_of([*BEGUN, *((node, "running", "failure", 3.0, ended) for node in (2, 1, 0))]), str
    )
    assert [failed.name for failed in found.every] == ["to the desk"]
    assert found.last == found.every[0]


def test_a_failure_that_did_not_end_the_mission_is_not_the_last():
    ended = why("NO_VALID_PATH", 2, is_new=True)
    found = failures_of(
        trace_of([*BEGUN, (2, "running", "failure", 3.0, ended),
                  (1, "running", "success", 3.0, {}), (0, "running", "success", 3.0, {})]), str
    )  # fmt: skip
    assert len(found.every) == 1
    assert found.last is None
