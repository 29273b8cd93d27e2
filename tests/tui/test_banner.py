"""What the banner says in each situation."""

from dataclasses import replace

import pytest

from stack.telemetry.records import MissionState
from tests.tui.sample_source import SampleSource
from tui.link import Link
from tui.panes.banner import notice

RUNNING = SampleSource().poll()


def test_nothing_is_said_while_all_goes_well():
    assert notice(RUNNING, Link(0.1)) is None
    assert notice(None, Link(3.0)) is None


@pytest.mark.parametrize(
    ("state", "tone", "word"),
    [
        (MissionState.SUCCESS, "good", "SUCCEEDED"),
        (MissionState.FAILURE, "bad", "FAILED"),
        (MissionState.ABORTED, "warn", "ABORTED"),
        (MissionState.INTERRUPTED, "warn", "INTERRUPTED"),
        (MissionState.ERROR, "bad", "INTERNAL ERROR"),
    ],
)
def test_the_outcome_is_said_with_its_reason_even_when_the_engine_is_gone(state, tone, word):
    said = notice(replace(RUNNING, state=state, reason="because"), Link(99.0, is_over=True))
    assert (said.tone, said.detail, said.keys) == (tone, "because", "q leaves")
    assert word in said.headline and "00:42.0, 21.0 m, 1 recovery" in said.headline


def test_every_way_to_end_has_words():
    for state in MissionState:
        said = notice(replace(RUNNING, state=state), Link(0.1))
        assert (said is not None) == (state not in (MissionState.RUNNING, MissionState.STARTING))


def test_a_silent_engine_is_lost_after_five_seconds():
    assert notice(RUNNING, Link(4.9)) is None
    said = notice(RUNNING, Link(5.1))
    assert said.tone == "bad" and "ENGINE LOST" in said.headline and "watch" in said.keys
    assert notice(None, Link(19.9)) is None  # kernels may be compiling
    assert "NO ENGINE ANSWERS" in notice(None, Link(20.1)).headline


def test_an_engine_that_ends_without_a_report_has_crashed():
    assert "CRASHED" in notice(RUNNING, Link(9.0, is_over=True)).headline
    assert "RUN ENDED" in notice(RUNNING, Link(9.0, is_over=True, has_report=True)).headline


def test_held_robots_show_the_key_that_continues():
    stopped = replace(RUNNING, state=MissionState.EMERGENCY_STOP, reason="operator")
    assert notice(stopped, Link(0.1)).keys == "R releases it"
    assert notice(replace(RUNNING, state=MissionState.PAUSED), Link(0.1)).keys == "p continues"


def test_an_unconfirmed_emergency_stop_is_reported():
    assert "NOT CONFIRMED" in notice(RUNNING, Link(0.1, stop_unconfirmed=True)).headline


def test_lost_records_are_shown_until_something_is_more_urgent():
    lost = replace(RUNNING, records_lost="events.jsonl from event 29 on (No space left on device)")
    said = notice(lost, Link(0.1))
    assert (said.tone, said.headline) == ("warn", "▲ RECORDS LOST")
    assert said.detail.startswith("events.jsonl from event 29")
    held = notice(replace(lost, state=MissionState.EMERGENCY_STOP), Link(0.1))
    assert "EMERGENCY STOP" in held.headline
