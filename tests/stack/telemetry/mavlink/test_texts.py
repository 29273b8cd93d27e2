"""Texts for operators."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.telemetry.mavlink.texts import Texts, text_chunks
from stack.telemetry.records import Event
from tests.stack.telemetry.mavlink.conftest import text_of


@settings(deadline=None, max_examples=200)
@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=120))
def test_chunks_of_a_text_join_to_the_text(text):
    pieces = list(text_chunks(text))
    assert b"".join(pieces).decode() == " ".join(text.split())
    assert all(len(piece) <= 50 for piece in pieces)
    assert len(pieces) == 1 or len(pieces[-1]) < 50


def test_a_long_text_is_truncated():
    pieces = list(text_chunks("ü" * 1000))
    assert len(pieces) == 8 and len(pieces[-1]) == 48


def event(kind, text, level="info", source="mission", **fields):
    return Event(0, 0, 0.0, level, source, kind, text, fields)


@pytest.mark.parametrize(
    ("given", "sent"),
    [
        (event("node_status", "not for the station", source="tree"), ""),
        (event("say", "hello"), "hello"),
        (event("replan", "a" * 60, "warning"), "a" * 60),
        (event("command", "estop: done", "warning", "command"), ""),
        (event("detour", "goal cancelled", "warning", "command", status="cancelled"), ""),
        (event("detour", "no way", "warning", "command", status="failure"), "no way"),
    ],
)
def test_warnings_and_texts_of_the_mission_are_sent(rig, given, sent):
    rig.handover.events.append(given)
    assert text_of(rig.go_on()) == sent


def test_a_flood_of_texts_is_limited(clock):
    sent = []
    texts = Texts(sent.append, clock)
    for _ in range(1000):
        texts.tell("again")
    assert len(sent) == 40
    clock.now += 1.0
    for _ in range(1000):
        texts.tell("again")
    assert len(sent) == 60
