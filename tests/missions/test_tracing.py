"""A trace tells from the records alone what ran, for how long, and what never did."""

from pathlib import Path

import pytest

from missions import tracing
from stack.errors import InputError
from stack.telemetry.event_log import event_line
from stack.telemetry.records import Event

ROWS = [
    [0, -1, "sequence", "patrol"],
    [1, 0, "navigate_to_pose", "to the desk"],
    [2, 0, "fallback", "either"],
    [3, 2, "check", "enough charge"],
    [4, 2, "say", "warn"],
    [5, 0, "wait", "rest"],
]
CHANGES = [  # node, from, to, time, message
    (0, "idle", "running", 0.0, ""),
    (1, "idle", "running", 0.0, ""),
    (1, "running", "success", 12.5, "there"),
    (3, "idle", "success", 12.5, ""),
    (2, "idle", "success", 12.5, ""),
    (5, "idle", "running", 12.6, ""),
    (5, "running", "idle", 13.6, ""),
    (0, "running", "idle", 13.6, ""),
]


@pytest.fixture
def run(tmp_path) -> Path:
    events = [Event(0, 0, 0.0, "info", "tree", "tree", "6 nodes", {"rows": ROWS})]
    for node, before, to, time, message in CHANGES:
        fields = {"node": node, "name": ROWS[node][3], "from": before, "to": to}
        fields["message"] = message
        events.append(Event(len(events), 0, time, "info", "tree", "node_status", "changed", fields))
    torn = b'{"fields":{},"ki'  # what kill -9 may leave behind
    (tmp_path / "events.jsonl").write_bytes(b"".join(map(event_line, events)) + torn)
    return tmp_path


def test_the_story_has_every_change_in_order_and_depth(run):
    lines = tracing.story(tracing.read_trace(run))
    assert len(lines) == len(CHANGES)
    assert lines[2] == "   12.50 s    ✔ to the desk: success (there)"
    assert lines[-2] == "   13.60 s    · rest: halted"


def test_a_node_can_be_picked_out_with_what_is_below_it(run):
    lines = tracing.story(tracing.read_trace(run), only="either")
    assert [line.split("s  ")[1].strip() for line in lines] == [
        "✔ enough charge: success", "✔ either: success",
    ]  # fmt: skip
    with pytest.raises(InputError, match="did you mean 'either'"):
        tracing.story(tracing.read_trace(run), only="eiter")


def test_the_summary_says_how_long_and_why_not(run):
    lines = {line.split("  ")[0].strip() or line.strip(): line for line in tracing.summary(
        tracing.read_trace(run)
    )}  # fmt: skip
    text = "\n".join(lines.values())
    assert "12.5 s  ✔ 1" in text
    assert "never reached: 'enough charge' before it ended with success" in text
    assert "1.0 s  halted 1" in text


def test_what_is_not_a_run_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"holds no events\.jsonl"):
        tracing.read_trace(tmp_path)
