"""Lists of faults in files: what they say, and what is refused with its place."""

import json
from math import inf, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.documents import Findings, read_text
from stack.errors import ParameterError
from stack.sim.faults.reading import changed, default_fault, read_faults
from stack.sim.faults.registry import fault_names
from stack.types import Pose2D

PLACES = {"dock": Pose2D(1.0, 2.0, 0.5)}


def read(text):
    findings = Findings()
    lines = "\n".join(f"  {line}" for line in text.splitlines())
    node = read_text(f"faults:\n{lines}\n", "a.yaml").get("faults")
    return read_faults(node.items, findings, PLACES), findings


def test_kind_numbers_time_and_duration():
    (fault,), found = read("- lidar_sector: {middle: 180 deg}\n  at: 20 s\n  for: 500 ms")
    assert (fault.time, fault.duration, fault.near, fault.per_minute) == (20.0, 0.5, None, 0.0)
    assert fault.parameters.middle == pytest.approx(pi) and not found.items


def test_a_word_alone_has_all_defaults():
    (fault,), _ = read("- push")
    assert fault == default_fault("push") and fault.duration == inf


def test_places_are_points_or_names_and_times_random():
    text = (
        "- push\n- push:\n  at: {near: dock, time: 3 s}\n- kidnap: {to: dock}\n"
        "  at: {near: [1, 2], within: 2 m, per_minute: 50 %}"
    )
    faults, found = read(text)
    assert not found.items and [fault.name for fault in faults] == ["push", "push_2", "kidnap"]
    assert (faults[1].near, faults[1].time) == ((1.0, 2.0, 0.5), 3.0)
    assert faults[2].near == (1.0, 2.0, 2.0) and faults[2].per_minute == 0.5
    assert faults[2].parameters.to == PLACES["dock"]


@pytest.mark.parametrize(
    ("text", "where", "sentence"),
    [
        ("- lidar_dropuot", (2, 5), "there is no fault 'lidar_dropuot'"),
        ("- {lidar_dropout: {share: 2}}", (2, 29), "lidar_dropout: share: 2 must be at most 1"),
        ("- {lidar_dropout: {shar: 1}}", (2, 28), "there is no parameter 'shar' here"),
        ("- {lidar_dropout: 3}", (2, 21), "lidar_dropout: expected its numbers"),
        ("- {push: {}, kidnap: {}}", (2, 5), "one kind with its numbers; got 2 of them"),
        ("- {at: 3 s}", (2, 5), "got 0 of them"),
        ("- [push]", (2, 5), "a fault is one kind with its numbers; got a list"),
        ("- {push: {}, for: 3 s}", (2, 21), "push happens in one moment: `for` has no meaning"),
        ("- {moved_furniture: {}, at: 3 s}", (2, 31), "there before the run: `at` has no meaning"),
        ("- {push: {}, at: 3 m}", (2, 20), "at: "),
        ("- {push: {}, at: {near: dok}}", (2, 27), "near: there is no place 'dok'"),
        ("- {push: {}, at: {nera: dock}}", (2, 21), "`at` has no key 'nera'"),
    ],
)
def test_what_is_wrong_has_a_place(text, where, sentence):
    _, findings = read(text)
    (item,) = findings.items
    assert sentence in item.sentence and item.code == "E210"
    assert (item.mark.line, item.mark.column) == where


def test_numbers_can_be_changed_by_name():
    fault = default_fault("lidar_dropout")
    assert changed(fault, "share", "40 %").parameters.share == 0.4
    assert changed(fault, "at", 3).time == 3.0 and changed(fault, "for", "2 s").duration == 2.0
    for kind, name in (("push", "for"), ("moved_furniture", "at"), ("push", "shar")):
        with pytest.raises(ParameterError, match=f"the fault {kind} has no number '{name}'"):
            changed(default_fault(kind), name, 1)
    with pytest.raises(ParameterError) as error:
        changed(fault, "per_minte", 1)
    assert error.value.hint == "did you mean 'per_minute'?"
    with pytest.raises(ParameterError) as error:
        changed(default_fault("push"), "for", 1)
    assert "'for'" not in error.value.hint


WORDS = [*fault_names(), "at", "dock"]


@given(st.recursive(
    st.none() | st.booleans() | st.integers(-1000, 1000) | st.sampled_from(WORDS),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.sampled_from([*fault_names(), "at", "for", "near"]), inner, max_size=3),
))  # fmt: skip
def test_any_entry_is_read_or_has_a_finding(entry):
    faults, findings = read(f"- {json.dumps(entry)}")
    assert len(faults) == 1 or findings.errors
