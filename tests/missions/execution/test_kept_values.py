"""Blackboard keys with `keep: true`: the next run begins with the value of the last one."""

import json
from textwrap import dedent

import pytest

import missions
from stack.errors import InputError

MISSION = """
    mission: counter
    robot: scout
    world: small_room
    places: {here: [1, 1, 90 deg]}
    blackboard:
      rounds: {type: int, initial: 0, keep: true}
      spots: {type: list of Pose, initial: [], keep: true}
      names: {type: list of text, initial: [], keep: true}
      dwell: {type: duration, optional: true, keep: true}
      free: {type: int, initial: 0}
    run:
      sequence:
        - set: {rounds: $rounds + 1, free: $free + 1, spots: 'append($spots, $here)'}
        - set: {names: 'append($names, "a")'}
        - {set: {dwell: 2.5 s}, when: $dwell is not set}
        - say: "${rounds} ${free} ${names} ${dwell}"
"""


@pytest.fixture
def run(tmp_path):
    file = tmp_path / "count.yaml"
    file.write_text(dedent(MISSION))
    numbers = iter(range(99))

    def once(**options):
        return missions.run(file, out=tmp_path / "runs" / str(next(numbers)), **options)

    once.file, once.kept = file, tmp_path / "runs" / "count.kept.json"
    return once


def test_a_run_begins_with_the_values_of_the_last_one(run):
    first, second, third = run(), run(), run()
    assert [r.blackboard["rounds"] for r in (first, second, third)] == ["1", "2", "3"]
    assert third.blackboard["free"] == "1"
    values = json.loads(run.kept.read_text())["values"]
    assert values["spots"] == {
        "type": "list of Pose",
        "value": [[1.0, 1.0, pytest.approx(1.5708, abs=1e-4)]] * 3,
    }
    assert values["dwell"] == {"type": "duration", "value": 2.5}
    assert "free" not in values


def test_the_log_names_the_values_because_they_change_the_run(run, tmp_path):
    run()
    second = run()
    lines = (tmp_path / "runs" / "1" / "events.jsonl").read_text().splitlines()
    kept = [event["text"] for event in map(json.loads, lines) if event["kind"] == "kept"]
    assert "rounds = 1, kept from the last run" in kept
    assert second.log_sha256 != run(forget_kept=True).log_sha256


def test_without_records_nothing_is_read_or_written(run):
    assert missions.run(run.file).blackboard["rounds"] == "1"
    assert not run.kept.exists()
    run()
    assert missions.run(run.file).blackboard["rounds"] == "1"


def test_forgetting_starts_from_the_initial_values_and_leaves_a_copy(run):
    run()
    before = run.kept.read_text()
    assert run(forget_kept=True).blackboard["rounds"] == "1"
    assert run.kept.with_name("count.kept.json.bak").read_text() == before


FILE = """{"format": 1, "mission": "counter", "values": {
    "rounds": {"type": "whole number", "value": 1}, "dwell": {"type": "duration", "value": 2.5}
}}"""


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (FILE[40:], "", "damaged"),
        (FILE, "[" * 100_000, "damaged"),
        (FILE, "[]", "damaged: expected an object"),
        (FILE, "", "damaged"),
        ('"format": 1', '"format": 7', "format 7"),
        ('"counter"', '"other"', "belongs to the mission 'other'"),
        ("whole number", "text", "'rounds' was kept as text, the mission declares whole number"),
        ('"value": 1', '"value": "one"', "'rounds'"),
        ('"value": 1', f'"value": {2**70}', "'rounds': .* 64 bits"),
        ("2.5", "NaN", "'dwell'"),
        ('"type": "whole number",', "", "'rounds' has no type"),
    ],
)
def test_a_file_that_does_not_fit_refuses_the_run_and_stays(run, old, new, sentence):
    damaged = FILE.replace(old, new)
    run.kept.parent.mkdir()
    run.kept.write_text(damaged)
    with pytest.raises(InputError, match=sentence) as refused:
        run()
    assert "--forget-kept" in str(refused.value)
    assert run.kept.read_text() == damaged


def test_a_file_that_fits_is_read(run):
    run.kept.parent.mkdir()
    run.kept.write_text(FILE)
    assert run().blackboard["rounds"] == "2"


def test_keys_that_are_no_longer_declared_stay_in_the_file(run):
    run()
    run.file.write_text(run.file.read_text().replace("rounds", "laps"))
    assert run().blackboard["laps"] == "1"
    assert {"rounds", "laps"} < set(json.loads(run.kept.read_text())["values"])
