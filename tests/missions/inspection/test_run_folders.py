"""`treepilot runs`: finds run folders, and deletes only what it may."""

import json
import os

import pytest
from typer.testing import CliRunner

from missions.cli.running.runs import runs_app
from missions.inspection.run_folders import (
    delete_run,
    find_runs,
    is_run_folder,
    older_than_newest,
)
from stack.errors import InputError
from stack.telemetry.event_log import event_line
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.records import Event


def make_run(parent, name, started, *, report=None):
    """A run folder with one event at 4.5 s, started at a time of the epoch, with 1000 bytes."""
    folder = RunFolder.create(parent / name, "mission: x\n")
    folder.events.write_bytes(event_line(Event(0, 90, 4.5, "info", "s", "pose", "")) + b'{"cut')
    (folder.path / "mission.rrd").write_bytes(bytes(1000))
    if report:
        folder.write_report({"mission": "the title", "status": report, "simulated_seconds": 9.0})
    os.utime(folder.path / "mission.yaml", (started, started))
    return folder


@pytest.fixture
def parent(tmp_path):
    """Three runs, and what looks similar."""
    runs = tmp_path / "runs"
    make_run(runs, "old", 1_000, report="success")
    make_run(runs, "newest", 3_000, report="failure")
    make_run(runs, "killed", 2_000)
    (runs / "notes").mkdir()
    (runs / "notes" / "events.jsonl").touch()
    make_run(tmp_path, "outside", 500)
    (runs / "linked").symlink_to(tmp_path / "outside", target_is_directory=True)
    return runs


def invoke(parent, *arguments, stdin=None):
    return CliRunner().invoke(runs_app, ["--folder", str(parent), *arguments], input=stdin)


def test_runs_are_listed_newest_first(parent):
    runs = find_runs(parent)
    assert [(run.name, run.status) for run in runs] == [
        ("newest", "failure"), ("killed", "incomplete"), ("old", "success"),
    ]  # fmt: skip
    assert [run.simulated_seconds for run in runs] == [9.0, 4.5, 9.0]
    assert runs[0].mission == "the title" and runs[1].mission == "killed"
    assert all(1000 < run.size < 2000 for run in runs)
    listed = json.loads(invoke(parent, "--json").stdout)
    assert [run["name"] for run in listed] == ["newest", "killed", "old"]
    assert "3 runs," in invoke(parent).stdout
    assert "no runs in" in invoke(parent / "none").stdout


def test_a_live_run_is_never_deleted(parent):
    recorder = Recorder(make_run(parent, "going", 100))
    recorder.open(None)
    assert {run.name: run.status for run in find_runs(parent)}["going"] == "live"
    with pytest.raises(InputError, match="going is live"):
        delete_run(parent, "going")
    result = invoke(parent, "delete", "--yes", "old", "going")
    assert result.exit_code != 0 and (parent / "old").exists()  # nothing at all
    assert "going" not in [run.name for run in older_than_newest(find_runs(parent), 0)]
    recorder.close(None)
    delete_run(parent, "going")
    assert not (parent / "going").exists()


@pytest.mark.parametrize("name", ["notes", "linked", "../outside", "..", "", "none"])
def test_only_run_folders_are_deleted(parent, name):
    with pytest.raises(InputError, match="not a run folder"):
        delete_run(parent, name)
    assert invoke(parent, "delete", "--yes", name).exit_code != 0
    assert (parent / "notes").exists() and (parent / "linked").exists()
    assert is_run_folder(parent.parent / "outside")


def test_links_in_a_run_are_not_followed(parent, tmp_path):
    kept = tmp_path / "kept"
    kept.mkdir()
    (kept / "file").touch()
    (parent / "old" / "pictures").symlink_to(kept, target_is_directory=True)
    delete_run(parent, "old")
    assert (kept / "file").exists() and not (parent / "old").exists()


def test_keep_leaves_the_newest(parent):
    assert invoke(parent, "keep", "5", "--yes").stdout == "nothing to delete\n"
    assert "deleted 2 runs" in invoke(parent, "keep", "1", "--yes").stdout
    assert [run.name for run in find_runs(parent)] == ["newest"]
    assert (parent / "notes").exists() and (parent / "linked").is_symlink()


def test_without_a_terminal_nothing_is_deleted_unasked(parent):
    result = invoke(parent, "keep", "0", stdin="y\n")
    assert isinstance(result.exception, InputError) and "needs --yes" in str(result.exception)
    assert len(find_runs(parent)) == 3


def test_foreign_and_huge_files_are_listed_at_once(tmp_path):
    """Only the end of an event log is read, and no report above its limit."""
    huge = make_run(tmp_path, "huge", 3_000)
    for name in ("events.jsonl", "report.json"):
        with (huge.path / name).open("r+b" if name == "events.jsonl" else "wb") as file:
            file.truncate(10_000_000_000)  # sparse: takes no space
    nested = make_run(tmp_path, "nested", 2_000)
    nested.events.write_bytes(b"[" * 60_000 + b"\n")
    nested.report.write_text("[" * 100_000)
    foreign = make_run(tmp_path, "foreign", 1_000)
    foreign.report.write_text(json.dumps({"mission": "a\x1b[2J\nb" * 100, "status": [1]}))
    runs = {run.name: run for run in find_runs(tmp_path)}
    assert list(runs) == ["huge", "nested", "foreign"]
    assert runs["huge"].status == runs["nested"].status == "incomplete"
    assert runs["huge"].size > 20_000_000_000 and runs["nested"].simulated_seconds == 0.0
    listed = invoke(tmp_path).stdout
    assert len(listed.splitlines()) == 5 and "\x1b" not in listed  # heading, runs, sum
