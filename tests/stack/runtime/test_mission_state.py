"""Every event in every state: the table below is written by hand, apart from the code's."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.runtime.mission_state import MissionEvent, MissionStateMachine
from stack.telemetry.records import MissionState

S, E = MissionState, MissionEvent
FINAL = (S.SUCCESS, S.FAILURE, S.ABORTED, S.INTERRUPTED, S.ERROR)

WAY_TO = {
    S.STARTING: [],
    S.RUNNING: [E.FIRST_TICK],
    S.PAUSED: [E.FIRST_TICK, E.PAUSE],
    S.EMERGENCY_STOP: [E.FIRST_TICK, E.EMERGENCY_STOP],
    S.SUCCESS: [E.FIRST_TICK, E.SUCCEED],
    S.FAILURE: [E.FIRST_TICK, E.FAIL],
    S.ABORTED: [E.ABORT],
    S.INTERRUPTED: [E.INTERRUPT],
    S.ERROR: [E.ERROR],
}
"""Events that lead from the start to each state."""

#                 first tick  pause     detour    resume    e-stop            release   succeed
LINES = {
    S.STARTING:       "RUNNING PAUSED - - EMERGENCY_STOP - -",
    S.RUNNING:        "- PAUSED PAUSED - EMERGENCY_STOP - SUCCESS",
    S.PAUSED:         "- PAUSED PAUSED RUNNING EMERGENCY_STOP - -",
    S.EMERGENCY_STOP: "- - - - EMERGENCY_STOP PAUSED -",
}  # fmt: skip
COLUMNS = (E.FIRST_TICK, E.PAUSE, E.DETOUR, E.RESUME, E.EMERGENCY_STOP, E.RELEASE, E.SUCCEED)
ENDS = {E.FAIL: S.FAILURE, E.ABORT: S.ABORTED, E.INTERRUPT: S.INTERRUPTED, E.ERROR: S.ERROR}


def expected(state: MissionState, event: MissionEvent) -> MissionState | None:
    """The next state; None if the event is refused."""
    if state in FINAL:
        return state if event is E.EMERGENCY_STOP else None
    if event in ENDS:
        return ENDS[event]
    word = LINES[state].split()[COLUMNS.index(event)]
    return None if word == "-" else S[word]


def machine_in(state: MissionState) -> MissionStateMachine:
    machine = MissionStateMachine()
    for event in WAY_TO[state]:
        assert machine.send(event) == ""
    assert machine.state is state
    return machine


@pytest.mark.parametrize("event", list(MissionEvent))
@pytest.mark.parametrize("state", list(MissionState))
def test_every_state_and_event(state, event):
    machine = machine_in(state)
    refusal = machine.send(event, "why")
    following = expected(state, event)
    assert machine.state is (following or state)
    assert bool(refusal) == (following is None)
    if following is None:
        assert machine.reason == ""


@pytest.mark.parametrize("state", list(MissionState))
def test_an_emergency_stop_is_accepted_everywhere_and_released_without_motion(state):
    machine = machine_in(state)
    machine.send(E.EMERGENCY_STOP, "a button")
    machine.send(E.EMERGENCY_STOP, "another one")
    assert machine.emergency_stop == "a button" or state is S.EMERGENCY_STOP
    assert not machine.ticks
    assert machine.send(E.RELEASE) == ""
    assert machine.emergency_stop == ""
    assert not machine.ticks
    assert machine.state is (state if state in FINAL else S.PAUSED)


@given(st.lists(st.sampled_from(list(MissionEvent)), max_size=30))
def test_only_a_first_tick_or_resume_starts_motion_and_an_end_is_final(events):
    machine = MissionStateMachine()
    for event in events:
        before = machine.state
        refusal = machine.send(event)
        after = machine.state
        if after is S.RUNNING and before is not S.RUNNING:
            assert event in (E.FIRST_TICK, E.RESUME)
        if before in FINAL or refusal:
            assert after is before
        assert machine.emergency_stop or after is not S.EMERGENCY_STOP
        assert not (machine.ticks and machine.emergency_stop)


def test_refusals_say_what_to_do():
    assert machine_in(S.EMERGENCY_STOP).send(E.RESUME) == (
        "cannot resume: the emergency stop is engaged; release it first"
    )
    assert machine_in(S.RUNNING).send(E.RESUME) == "cannot resume: the mission is running"
    assert machine_in(S.SUCCESS).send(E.PAUSE) == "the mission is over (success)"
    assert machine_in(S.PAUSED).send(E.RELEASE) == "the emergency stop is not engaged"


def test_a_reason_belongs_to_its_state():
    machine = machine_in(S.RUNNING)
    machine.send(E.PAUSE, "at a breakpoint")
    assert machine.reason == "at a breakpoint"
    machine.send(E.RESUME)
    assert machine.reason == ""
