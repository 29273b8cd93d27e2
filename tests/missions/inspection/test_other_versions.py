"""Runs of other versions, and damaged ones: shown as far as they go, or refused in one sentence."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from missions.execution.report import read_fields
from stack.errors import InputError, TelemetryError
from stack.telemetry.snapshots.format import schemas
from tests.missions.inspection import damage
from tests.missions.inspection.foreign_run import COMMANDS, explain, look_at, record

WHOLE = [name for name in COMMANDS if name not in ("runs open zip", "runs open rerun")]
"""Commands that read the records of a run."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder, _ = record(tmp_path_factory.mktemp("recorded"))
    return folder


@pytest.fixture
def damaged(run, tmp_path):
    """Return a copy of the run that a function has changed."""

    def make(change: Callable[[Path], None]) -> Path:
        copy = tmp_path / "runs" / "copy"
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(run, copy)
        change(copy)
        return copy

    return make


def assert_told(command: str, run: Path, out: Path) -> None:
    """Carry out a command: it ends in order, or refuses the run in one sentence."""
    code, _, refused = explain(command, run, out)
    assert code in (0, 2), refused
    assert "Traceback" not in refused
    if code == 2:
        assert len(refused.strip().splitlines()) == 1, refused


CHOICES = settings(
    max_examples=25, deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip


@pytest.mark.slow
@CHOICES
@given(data=st.data())
def test_any_field_may_be_missing_or_new(data, damaged, run, tmp_path):
    file = data.draw(st.sampled_from(["events.jsonl", "report.json", "inputs.json"]))
    content = damage.read(run / file)
    if data.draw(st.booleans()):
        way = data.draw(st.sampled_from([*damage.fields(content)]))
        copy = damaged(
            lambda made: damage.rewrite(made / file, lambda value: damage.without(value, way))
        )
    else:
        way = data.draw(st.sampled_from([*damage.mappings(content)]))
        copy = damaged(
            lambda made: damage.rewrite(made / file, lambda value: damage.with_novelty(value, way))
        )
    assert_told(data.draw(st.sampled_from(WHOLE)), copy, tmp_path)


@pytest.mark.slow
@CHOICES
@given(data=st.data())
def test_a_snapshot_may_have_more_or_fewer_fields(data, damaged, tmp_path):
    kind = data.draw(st.sampled_from([*schemas()]))
    name = data.draw(st.sampled_from([*schemas()[kind], ""]))

    def change(fields):
        fields.pop(name, None) if name else fields.update(novelty="a later version")

    copy = damaged(lambda made: damage.rewrite_mcap(made / "snapshots.mcap", kind, change))
    assert_told(data.draw(st.sampled_from(WHOLE)), copy, tmp_path)


@pytest.mark.slow
@CHOICES
@given(data=st.data())
def test_any_file_may_be_cut_off_anywhere(data, damaged, tmp_path):
    file, share = data.draw(st.sampled_from(damage.RECORDS)), data.draw(st.floats(0.0, 1.0))
    copy = damaged(lambda made: damage.cut(made / file, share))
    assert_told(data.draw(st.sampled_from(WHOLE)), copy, tmp_path)


def test_unknown_events_are_shown_and_nothing_else(damaged, tmp_path):
    """An event of a later version is a line of the trace with its text."""

    def change(events):
        told = {**events[-1], "kind": "novelty", "text": "of a later version", "fields": {}}
        return [*events, {**told, "number": len(events), "colour": "green"}]

    copy = damaged(lambda made: damage.rewrite(made / "events.jsonl", change))
    _, told, _ = explain("trace", copy, tmp_path)
    assert told.rstrip().endswith(": of a later version")
    look_at(copy)


def test_a_report_of_another_version_is_read_as_far_as_it_goes(damaged, tmp_path, run):
    whole = read_fields(run)
    assert whole == json.loads((run / "report.json").read_text("utf-8"))  # no field is lost

    def change(report):
        del report["distance_m"], report["held"]
        return {**report, "seed": {"first": 1}, "novelty": 2}

    copy = damaged(lambda made: damage.rewrite(made / "report.json", change))
    assert read_fields(copy) == {
        name: value for name, value in whole.items() if name not in ("distance_m", "held", "seed")
    }
    assert explain("report", copy, tmp_path)[0] == 0
    page = (tmp_path / "page.html").read_text("utf-8")
    assert "recoveries, replans" in page and "<th>driven</th>" not in page


def test_the_dashboard_shows_half_a_run_and_says_what_is_damaged(damaged):
    look_at(damaged(lambda made: damage.cut(made / "snapshots.mcap", 0.5)))
    copy = damaged(lambda made: damage.cut(made / "snapshots.mcap", 0.001))
    with pytest.raises((InputError, TelemetryError), match=r"snapshots\.mcap"):
        look_at(copy)
