"""State machine of a mission: the only writer of its state.

Operator, debugger, failsafes and the step loop send events. `TRANSITIONS` has every event that a
state accepts; all others are refused with a reason. Releasing the emergency stop never starts
motion: the mission is paused then, and `resume` continues it.

An emergency stop is accepted in every state. After the end of a mission the state remains final,
and the robot is held all the same.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from stack.telemetry.records import MissionState

S = MissionState

HELD = frozenset({S.PAUSED, S.EMERGENCY_STOP})
"""States in which the robot is held and the mission may continue."""


class MissionEvent(StrEnum):
    """What may happen to a mission."""

    FIRST_TICK = "start"
    PAUSE = "pause"
    DETOUR = "begin a detour"
    RESUME = "resume"
    EMERGENCY_STOP = "estop"
    RELEASE = "release"
    SUCCEED = "succeed"
    FAIL = "fail"
    ABORT = "abort"
    INTERRUPT = "interrupt"
    ERROR = "error"


E = MissionEvent

_ENDS = {
    E.FAIL: S.FAILURE,
    E.ABORT: S.ABORTED,
    E.INTERRUPT: S.INTERRUPTED,
    E.ERROR: S.ERROR,
}

TRANSITIONS: dict[MissionState, dict[MissionEvent, MissionState]] = {
    S.STARTING: {
        E.FIRST_TICK: S.RUNNING, E.PAUSE: S.PAUSED, E.EMERGENCY_STOP: S.EMERGENCY_STOP, **_ENDS,
    },
    S.RUNNING: {
        E.PAUSE: S.PAUSED, E.DETOUR: S.PAUSED, E.EMERGENCY_STOP: S.EMERGENCY_STOP,
        E.SUCCEED: S.SUCCESS, **_ENDS,
    },
    S.PAUSED: {
        E.PAUSE: S.PAUSED, E.DETOUR: S.PAUSED, E.RESUME: S.RUNNING,
        E.EMERGENCY_STOP: S.EMERGENCY_STOP, **_ENDS,
    },
    S.EMERGENCY_STOP: {
        E.EMERGENCY_STOP: S.EMERGENCY_STOP, E.RELEASE: S.PAUSED, **_ENDS,
    },
    **{
        state: {E.EMERGENCY_STOP: state, E.RELEASE: state}
        for state in (S.SUCCESS, S.FAILURE, S.ABORTED, S.INTERRUPTED, S.ERROR)
    },
}  # fmt: skip
"""Next state by state and event."""


class MissionStateMachine:
    """State of the mission, why it is in it, and whether the emergency stop is engaged.

    Args:
        changed: called with the old and the new state after each change.
    """

    def __init__(
        self, changed: Callable[[MissionState, MissionState], None] = lambda before, after: None
    ) -> None:
        self._changed = changed
        self._state, self._reason = MissionState.STARTING, ""
        self._emergency_stop = ""

    @property
    def state(self) -> MissionState:
        """Current state."""
        return self._state

    @property
    def reason(self) -> str:
        """Why the mission is in this state; may be empty."""
        return self._reason

    @property
    def emergency_stop(self) -> str:
        """Reason of the engaged emergency stop; empty if it is released."""
        return self._emergency_stop

    @property
    def ticks(self) -> bool:
        """Whether the tree is ticked in this state."""
        return self._state in (MissionState.STARTING, MissionState.RUNNING)

    @property
    def is_held(self) -> bool:
        """Whether the robot is held: paused or stopped, but not over."""
        return self._state in HELD

    def refusal(self, event: MissionEvent) -> str:
        """Return why the current state refuses an event; empty if it accepts it."""
        if event is MissionEvent.RELEASE and not self._emergency_stop:
            return "the emergency stop is not engaged"
        if event in TRANSITIONS[self._state]:
            return ""
        if self._state.is_over:
            return f"the mission is over ({self._state})"
        if self._state is MissionState.EMERGENCY_STOP:
            return f"cannot {event}: the emergency stop is engaged; release it first"
        return f"cannot {event}: the mission is {self._state}"

    def send(self, event: MissionEvent, reason: str = "") -> str:
        """Apply an event; return why it was refused, or an empty text.

        Args:
            event: to apply.
            reason: of the new state, shown to the operator.
        """
        refusal = self.refusal(event)
        if refusal:
            return refusal
        if event is MissionEvent.EMERGENCY_STOP:
            self._emergency_stop = self._emergency_stop or reason or "no reason given"
        elif event is MissionEvent.RELEASE:
            self._emergency_stop = ""
        if not self._state.is_over:
            before, self._state = self._state, TRANSITIONS[self._state][event]
            self._reason = reason
            if self._state is not before:
                self._changed(before, self._state)
        return ""
