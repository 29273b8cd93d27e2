import hashlib
import json
from math import inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import InputError, TelemetryError
from stack.telemetry.event_log import event_line, read_events
from stack.telemetry.hub import Telemetry
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.records import Event


def test_a_run_leaves_its_folder(tmp_path, info):
    folder = RunFolder.create(tmp_path / "runs" / "one", "mission: one\n")
    telemetry = Telemetry(info, [Recorder(folder)], folder.log)
    events = [telemetry.emit("say", f"line {n}", source="mission", n=n) for n in range(3)]
    folder.log("a line")
    telemetry.close({"result": "success"})
    folder.write_report({"result": "success", "worst": inf})
    assert sorted(item.name for item in folder.path.iterdir()) == [
        "events.jsonl", "log.txt", "mission.yaml", "report.json",
    ]  # fmt: skip
    assert list(read_events(folder.events)) == events
    assert json.loads(folder.report.read_text("utf-8")) == {"result": "success", "worst": "inf"}
    assert hashlib.sha256(folder.events.read_bytes()).hexdigest() == telemetry.log_sha256


def test_a_folder_with_something_in_it_is_refused(tmp_path):
    (tmp_path / "old").touch()
    with pytest.raises(InputError, match="is not empty; choose another"):
        RunFolder.create(tmp_path)


def test_a_file_in_the_way_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a file"):
        RunFolder.create(tmp_path / "file")
    with pytest.raises(InputError, match="cannot write"):
        RunFolder.create(tmp_path / "file" / "below")


def test_pictures_stay_inside(tmp_path):
    folder = RunFolder.create(tmp_path / "run")
    assert folder.write("pictures/dock.jpg", b"jpeg") == "pictures/dock.jpg"
    with pytest.raises(InputError, match="not inside"):
        folder.write("../elsewhere", b"")


def test_an_incomplete_last_line_is_skipped(tmp_path):
    event = Event(0, 1, 0.05, "info", "tree", "kind", "text", {"a": [1.5, None]})
    path = tmp_path / "events.jsonl"
    path.write_bytes(event_line(event) + event_line(event)[:20])
    assert list(read_events(path)) == [event]


@pytest.mark.parametrize(
    ("line", "what"),
    [
        (b"{\n", "not an event"),
        (b"[]\n", "expected the keys"),
        (b"{}\n", "expected the keys"),
        (
            event_line(Event(0, 0, 0.0, "", "", "", "")).replace(b"0.0", b'"0"'),
            "time: expected float, got '0'",
        ),
    ],
)
def test_what_is_not_an_event_is_named_with_its_line(tmp_path, line, what):
    path = tmp_path / "events.jsonl"
    path.write_bytes(event_line(Event(0, 0, 0.0, "info", "", "", "")) + line)
    with pytest.raises(TelemetryError, match=rf"events.jsonl:2: .*{what}"):
        list(read_events(path))


@settings(deadline=None, max_examples=100)
@given(st.text(), st.floats(allow_nan=False, allow_infinity=False))
def test_any_text_and_number_reads_back(tmp_path_factory, text, number):
    event = Event(0, 0, number, "info", "s", "k", text, {text: number})
    line = event_line(event)
    assert line.count(b"\n") == 1
    path = tmp_path_factory.getbasetemp() / "property.jsonl"
    path.write_bytes(line)
    assert list(read_events(path)) == [event]


def test_nan_is_written_as_text():
    assert b'{"x":"nan"}' in event_line(Event(0, 0, 0.0, "", "", "", "", {"x": nan}))
