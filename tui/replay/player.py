"""Plays the snapshots of a run folder; a data source of the dashboard, like a live run."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import monotonic  # noqa: TID251 - a replay is played in wall time
from typing import Any

from stack.errors import TelemetryError
from stack.telemetry.records import ROUTINE, Ack, Command, Event, RunInfo, Snapshot
from stack.telemetry.snapshots.recording import SnapshotRecording
from tui.panes.map_pane import Ends

SLOWEST, FASTEST = 0.125, 64.0
"""Robot seconds per wall second."""

FOLLOW_PERIOD = 0.5
"""Wall seconds between two looks for what a live run has written."""

BEFORE = 60.0
"""Robot time before a jump's target of which charts and the driven way are shown, s."""

PAST = 75
"""Snapshots that are shown of this time."""

SHOWN_EVENTS = 2000
"""Events that are shown after a jump."""

TROUBLES = ("doubt", "failsafe", "sensor", "camera")
"""Kinds of events whose warnings count as failures."""

LEAP = 2.0
"""Robot time by which playing advances at most without a jump, s."""


@dataclass(frozen=True, slots=True)
class Moments:
    """Times of the events that a replay can jump to, ascending, seconds."""

    events: tuple[float, ...]
    warnings: tuple[float, ...]
    failures: tuple[float, ...]


class Player:
    """A recorded run with a play head. It implements the dashboard's Source.

    Args:
        recording: of the run; closed with the player.
        clock: returns wall seconds.
        factor: robot seconds per wall second.
        doors: ends of the doors of the world by name.

    Attributes:
        recording: of the run.
        factor: robot seconds per wall second.
        is_playing: whether the play head moves.
        jumped: whether the head has jumped since `poll` returned a snapshot: what was shown before
            is not the past of what is shown now.
    """

    silent_for = 0.0
    pictures = False
    is_over = False
    report: Mapping[str, Any] | None = None

    def __init__(
        self, recording: SnapshotRecording, clock: Callable[[], float] = monotonic,
        factor: float = 1.0, doors: Mapping[str, Ends] | None = None,
    ) -> None:  # fmt: skip
        self.recording = recording
        self.factor, self.is_playing, self.jumped = factor, True, True
        self._clock, self._at, self._followed = clock, clock(), clock()
        self._time = recording.times[0]
        self._number = self._next_event = -1
        self._log: list[Event] = []
        self._doors = doors or {}
        self._moments = Moments((), (), ())
        self._read_log()

    @property
    def info(self) -> RunInfo | None:
        """Description of the run."""
        return self.recording.info

    @property
    def begin(self) -> float:
        """Robot time of the first snapshot, s."""
        return self.recording.times[0]

    @property
    def end(self) -> float:
        """Robot time of the last snapshot, s."""
        return self.recording.times[-1]

    @property
    def time(self) -> float:
        """Robot time of the play head, s."""
        return self._time

    @property
    def moments(self) -> Moments:
        """Times of events, warnings and failures."""
        return self._moments

    def poll(self) -> Snapshot | None:
        """Move the head; return the snapshot there if it is another one than before."""
        now = self._clock()
        passed, self._at = now - self._at, now
        self._follow(now)
        if self.is_playing:
            ahead = passed * self.factor
            self.jumped = self.jumped or ahead > LEAP * max(1.0, self.factor)
            self._time = min(self._time + ahead, self.end)
            if self._time >= self.end and self.recording.is_complete:
                self.is_playing = False
        number = self.recording.index_at(self._time)
        if number == self._number and not self.jumped:
            return None
        self._number = number
        return self.recording.snapshot(number)

    def events(self) -> list[Event]:
        """The events up to the head that were not returned yet; after a jump, all of them."""
        if self._number < 0:
            return []
        end = self.recording.events_before(self._number)
        if self.jumped:
            self._next_event = max(0, end - SHOWN_EVENTS)
        first, self._next_event = self._next_event, end
        return self.recording.events(first, end)

    def land(self) -> list[Snapshot] | None:
        """After a jump, the snapshots of the minute before the head, oldest first; else None."""
        if not self.jumped:
            return None
        self.jumped = False
        first = self.recording.index_at(self._time - BEFORE)
        stride = max(1, (self._number - first) // PAST)
        numbers = range(first, self._number, stride)
        return [self.recording.snapshot(number, whole=False) for number in numbers]

    def toggle(self) -> None:
        """Play or pause; at the end, play again from the beginning."""
        if not self.is_playing and self._time >= self.end:
            self.seek(self.begin)
        self.is_playing = not self.is_playing

    def change_speed(self, factor: float) -> float:
        """Multiply the speed; return it."""
        self.factor = min(FASTEST, max(SLOWEST, self.factor * factor))
        return self.factor

    def seek(self, time: float) -> None:
        """Move the head to a robot time, s."""
        self._time = min(max(time, self.begin), self.end)
        self.jumped = True

    def step(self, count: int) -> None:
        """Pause, and move the head by snapshots."""
        self.is_playing = False
        number = min(max(self._number + count, 0), len(self.recording.times) - 1)
        if count < 0 or number - self._number > 1:
            self.jumped = True
        self._time = self.recording.times[number]

    def seek_next(self, times: tuple[float, ...], direction: int) -> bool:
        """Pause at the next of these times after the head, or at the last one before it.

        Args:
            times: ascending, s.
            direction: 1: forwards; -1: backwards.

        Returns:
            Whether there is one.
        """
        if direction > 0:
            index = bisect_right(times, self._time + 1e-6)
        else:
            index = bisect_left(times, self._time - 1e-6) - 1
        if not 0 <= index < len(times):
            return False
        self.is_playing = False
        self.seek(times[index])
        return True

    def doors_at_head(self) -> list[tuple[Ends, bool]]:
        """The doors of the world, and whether each is closed."""
        closed: dict[object, bool] = {}
        for event in self._log:
            if event.kind == "door" and event.time <= self._time:
                closed[event.fields.get("door")] = bool(event.fields.get("closed"))
        return [(ends, closed.get(name, False)) for name, ends in self._doors.items()]

    def changes_of(self, node: int) -> tuple[float, ...]:
        """Times at which the status of a node of the tree changed, ascending, s."""
        return tuple(
            event.time
            for event in self._log
            if event.kind == "node_status" and event.fields.get("node") == node
        )

    def send(self, command: Command) -> None:
        """Refuse: nobody is there to command.

        Raises:
            TelemetryError: always.
        """
        raise TelemetryError(
            f"this is a replay: there is no robot to {_WORDS.get(command.kind, 'command')}"
        )

    def acks(self) -> list[Ack]:
        """None: no command was accepted."""
        return []

    def close(self) -> None:
        """Close the recording."""
        self.recording.close()

    def _follow(self, now: float) -> None:
        """Take note of what a run that is not over has written."""
        if self.recording.is_complete or now - self._followed < FOLLOW_PERIOD:
            return
        self._followed = now
        if self.recording.follow():
            self._read_log()

    def _read_log(self) -> None:
        last = len(self.recording.times) - 1
        end = self.recording.events_before(last)
        self._log += self.recording.events(len(self._log), end)
        told = [event for event in self._log if event.kind not in ROUTINE]
        self._moments = Moments(
            tuple(event.time for event in told),
            tuple(event.time for event in told if event.level == "warning"),
            tuple(event.time for event in self._log if is_failure(event)),
        )


def is_failure(event: Event) -> bool:
    """Whether an event is an error, or says that a node failed, or that the robot is in trouble."""
    if event.kind == "node_status":
        return event.fields.get("to") == "failure"
    return event.level == "error" or (event.kind in TROUBLES and event.level == "warning")


_WORDS = {
    "set_goal": "send to a place", "set_pose": "set the pose of", "set_parameter": "tune",
    "estop": "stop", "release": "release", "speed": "simulate", "abort": "abort",
    "teleop": "drive", "teleop_done": "drive", "break": "hold", "unbreak": "hold",
    "force": "force", "step": "step", "continue": "continue", "pause": "pause",
    "resume": "resume",
}  # fmt: skip
