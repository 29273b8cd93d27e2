"""A trace shows from the event log alone what ran, for how long, and what was never reached."""

import json
from pathlib import Path

import pytest

from missions.inspection import trace as tracing
from missions.inspection.run_folders import find_run, find_runs
from stack.errors import InputError, TelemetryError
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


def test_a_node_without_a_story_says_why_it_was_never_reached(run):
    lines = tracing.story(tracing.read_trace(run), only="warn")
    assert lines == ["warn: never reached: previous node 'enough charge' ended with success"]


def test_the_summary_says_how_long_and_why_not(run):
    lines = {line.split("  ")[0].strip() or line.strip(): line for line in tracing.summary(
        tracing.read_trace(run)
    )}  # fmt: skip
    text = "\n".join(lines.values())
    assert "12.5 s  ✔ 1" in text
    assert "never reached: previous node 'enough charge' ended with success" in text
    assert "1.0 s  halted 1  12.60 s running … 13.60 s halted" in text


def test_newest_and_names_find_runs_in_the_folder_of_runs(run, tmp_path):
    parent = tmp_path / "runs"
    for name, started in (("b", "2026-01-02T00:00:00"), ("a", "2026-01-03T00:00:00")):
        (parent / name).mkdir(parents=True)
        (parent / name / "events.jsonl").write_bytes((run / "events.jsonl").read_bytes())
        (parent / name / "mission.yaml").write_text("mission: a\n")
        (parent / name / "report.json").write_text(json.dumps({"started": started}))
    assert find_run("b", parent) == parent / "b"
    assert find_run(str(run), parent) == run
    assert find_run("newest", parent).name == find_runs(parent)[0].name
    with pytest.raises(InputError, match=r"there is no run in .*/empty"):
        find_run("newest", tmp_path / "empty")


def test_what_is_not_a_run_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"has no events\.jsonl"):
        tracing.read_trace(tmp_path)


def log_of(folder, *events):
    lines = [event_line(Event(n, 0, 0.0, "info", "s", *event)) for n, event in enumerate(events)]
    (folder / "events.jsonl").write_bytes(b"".join(lines))
    return folder


def test_a_huge_log_is_refused_before_it_is_read(tmp_path):
    with (tmp_path / "events.jsonl").open("wb") as log:
        log.truncate(10_000_000_000)  # sparse: takes no space
    with pytest.raises(InputError, match="has 10000000000 bytes; at most 268435456 are read"):
        tracing.read_trace(tmp_path)


def test_a_huge_line_is_not_read_to_its_end(tmp_path):
    with (tmp_path / "events.jsonl").open("wb") as log:
        log.truncate(200_000_000)
    with pytest.raises(TelemetryError, match="jsonl:1: not an event: 67108864 bytes or more"):
        tracing.read_trace(tmp_path)


NESTED = b'{"fields":' + b"[" * 100_000 + b"\n"


def test_a_log_of_another_program_is_refused_with_its_line(tmp_path):
    (tmp_path / "events.jsonl").write_bytes(NESTED)
    with pytest.raises(TelemetryError, match="jsonl:1: not an event"):
        tracing.read_trace(tmp_path)


TREE = ("tree", "1 node", {"rows": [[0, -1, "say", "hello"]]})


@pytest.mark.parametrize(
    "events",
    [
        [("node_status", "", {"node": 0, "from": "idle", "to": "running"})],
        [TREE, ("node_status", "", {"node": 7, "from": "idle", "to": "running"})],
        [TREE, ("node_status", "", {"to": "running"})],
        [TREE, ("breakpoint", "", {"nodes": 5})],
        [("tree", "", {})],
        [("tree", "", {"rows": [[0]]})],
        [("tree", "", {"rows": [[0, 1, "say", "a"], [1, 0, "say", "b"]]})],  # each below the other
        [("tree", "", {"rows": [[0, "root", "say", "a"]]})],
    ],
)
def test_events_that_no_run_writes_are_refused_with_their_line(tmp_path, events):
    with pytest.raises(InputError, match=rf"jsonl:{len(events)}:1 .*not an event of a run"):
        tracing.read_trace(log_of(tmp_path, *events))


SECOND = [
    [0, -1, "events", "events", "a.yaml:9"],
    [1, 0, "event", "bell", "a.yaml:9"],
    [2, 1, "say", "ring", "a.yaml:10"],
    [3, 0, "sequence", "patrol", "a.yaml:3"],
    [4, 3, "act", "forced one", "a.yaml:4"],
    [5, 3, "wait", "rest", "a.yaml:5"],
    [6, 3, "use", "greet", "a.yaml:6"],
    [7, 6, "say", "hello", "a.yaml:7"],
]


@pytest.fixture
def reloaded(run) -> Path:
    """The run continues with a second tree, a forced node and a breakpoint never passed."""
    path = run / "events.jsonl"
    whole = path.read_bytes().rpartition(b"\n")[0] + b"\n"
    events = []

    def add(time, kind, text, **fields):
        source = "tree" if kind in ("tree", "node_status", "breakpoint") else "mission"
        number = whole.count(b"\n") + len(events)
        events.append(Event(number, 0, time, "info", source, kind, text, fields))

    def change(node, before, to, time, message=""):
        fields = {"node": node, "name": SECOND[node][3], "from": before, "to": to}
        add(time, "node_status", "changed", **fields, message=message)

    add(13.6, "saved", "a.yaml saved: halting the tree to reload it")
    add(14.0, "reload", "tree 2 starts from its root")
    add(14.0, "tree", "8 nodes", rows=SECOND)
    add(14.0, "command", "force: 'forced one': success", command="force", refused="",
        arguments={"node": "a.yaml:4", "status": "success"})  # fmt: skip
    change(4, "idle", "success", 14.0, "forced by the operator")
    change(3, "idle", "running", 14.0)
    change(0, "idle", "running", 14.0)
    add(14.0, "breakpoint", "stopped before the start of 'rest'", nodes=[5])
    change(3, "running", "idle", 20.0)
    change(0, "running", "idle", 20.0)
    add(20.0, "mission_ended", "aborted", state="aborted", reason="by the operator")
    path.write_bytes(whole + b"".join(map(event_line, events)))
    return run


def test_a_reloaded_mission_is_shown_tree_by_tree(reloaded):
    lines = tracing.story(tracing.read_trace(reloaded))
    assert lines[len(CHANGES) :] == [
        "   13.60 s    mission: a.yaml saved: halting the tree to reload it",
        "   14.00 s    mission: tree 2 starts from its root",
        "   14.00 s  ── tree 2, 8 nodes ──",
        "   14.00 s    mission: force: 'forced one': success",
        "   14.00 s  ▶ events: running",
        "   14.00 s    ▶ patrol: running",
        "   14.00 s      ✔ forced one: success (forced by the operator)",
        "   14.00 s    tree: stopped before the start of 'rest'",
        "   20.00 s    · patrol: halted",
        "   20.00 s  · events: halted",
        "   20.00 s    mission: aborted",
    ]


def test_the_reasons_know_of_forces_breakpoints_events_and_reloads(reloaded):
    second = tracing.summary(tracing.read_trace(reloaded))[7:]
    assert second[0] == "── tree 2, from 14.00 s, until the mission was aborted ──"
    why = {line.split("never")[0].strip(): line.partition("reached: ")[2] for line in second[2:]}
    assert why["bell"] == "the event did not occur"
    assert why["ring"] == "parent 'bell' not reached"
    assert why["rest"] == "stopped at a breakpoint until the mission was aborted"
    assert why["greet"] == "previous node 'rest' stopped at a breakpoint"
    assert why["hello"] == "parent 'greet' not reached"
    alone = tracing.summary(tracing.read_trace(reloaded), only="patrol/hello")[-1]
    why_not = "parent 'greet' not reached: previous node 'rest' stopped at a breakpoint"
    assert alone.endswith(why_not)


def test_the_filter_keeps_what_operators_did_to_the_node(reloaded):
    trace = tracing.read_trace(reloaded)
    forced = tracing.story(trace, only="forced one")
    assert [line[12:] for line in forced] == [
        "  mission: a.yaml saved: halting the tree to reload it",
        "  mission: tree 2 starts from its root",
        "── tree 2, 8 nodes ──",
        "  mission: force: 'forced one': success",
        "    ✔ forced one: success (forced by the operator)",
    ]
    stopped = tracing.story(trace, only="a.yaml:5")
    assert "stopped before the start of 'rest'" in "\n".join(stopped)
    assert "force:" not in "\n".join(stopped)


@pytest.mark.parametrize(
    ("time", "statuses"),
    [(0.0, "▶▶····"), (12.5, "▶✔✔✔··"), (13.0, "▶✔✔✔·▶"), (99.0, "·✔✔✔··")],
)
def test_the_tree_can_be_seen_as_it_was(run, time, statuses):
    heading, *lines = tracing.tree_at(tracing.read_trace(run), time)
    assert heading == f"the tree at {time:.2f} s:"
    assert "".join(line.lstrip()[0] for line in lines) == statuses
    assert [line.lstrip()[2:].partition(":")[0] for line in lines] == [row[3] for row in ROWS]
    with pytest.raises(InputError, match="the mission had not begun"):
        tracing.tree_at(tracing.read_trace(run), -1.0)
