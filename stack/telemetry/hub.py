"""Telemetry hub: numbers and hashes events, feeds the sinks, collects commands."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from hashlib import sha256
from typing import Any

from stack.telemetry.event_log import event_line, json_value, without_local_details
from stack.telemetry.lost_records import LostRecord, RecordFull
from stack.telemetry.records import Ack, Command, Event, RunInfo, Snapshot
from stack.telemetry.sinks import CommandSource, LinkSink, RecordSink, Sink

LEVELS = ("info", "warning", "error")
REPLAYED = 1000
"""Number of past events that a sink receives when it is attached late."""

EVENTS, SENSORS, SNAPSHOTS = "events.jsonl", "sensors.mcap", "snapshots.mcap"
"""Files of the run folder."""


def _reproducible(value: Any) -> Any:
    return without_local_details(value) if isinstance(value, str) else value


def reason_of(error: Exception) -> str:
    """Why a record cannot be written: the system's words, or the error."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return f"{type(error).__name__}: {error}"


def discard(line: str) -> None:
    """Drop a line of the log: there is no run folder."""


class Telemetry:
    """Numbers and hashes events, feeds sinks, and collects commands of operators.

    All calls come from the engine's thread. A sink that raises is removed with one line in the
    log; the mission continues. If it wrote a record, that is noted in `lost` and shown. If it was a
    link to other programs, the event `link_lost` tells it.

    Args:
        info: constant data of this run.
        sinks: opened at once.
        log: takes lines for the run's log.
        warn: takes lines for the log and the screen; None: as `log`.

    Attributes:
        info: constant data of this run.
        count: number of events so far, and the number of the next one.
    """

    def __init__(
        self, info: RunInfo, sinks: Iterable[Sink] = (), log: Callable[[str], None] = discard,
        warn: Callable[[str], None] | None = None,
    ) -> None:  # fmt: skip
        self.info, self.count = info, 0
        self._log, self._warn = log, warn or log
        self._lost: dict[str, LostRecord] = {}
        self._sinks: dict[int, Sink] = {}
        self._sources: dict[int, CommandSource] = {}
        self._lost_links: list[tuple[str, str]] = []
        self._attached = 0
        self._step, self._time = 0, 0.0
        self._digest = sha256()
        self._past: deque[Event] = deque(maxlen=REPLAYED)
        for sink in sinks:
            self.attach(sink)

    @property
    def log_sha256(self) -> str:
        """SHA-256 of all events so far: of the bytes of events.jsonl."""
        return self._digest.hexdigest()

    @property
    def lost(self) -> tuple[LostRecord, ...]:
        """The records that could not be written, in order of their loss."""
        return tuple(self._lost.values())

    def lose(self, record: str, reason: str, event: int | None = None) -> None:
        """Note that a record cannot be written from now on, and warn; once for each record.

        Args:
            record: path of the file relative to the run folder.
            reason: why.
            event: number of the first missing event, of events.jsonl.
        """
        if record not in self._lost:
            lost = self._lost[record] = LostRecord(record, float(self._time), reason, event)
            self._warn(f"! records lost: {lost.text}")

    def attach(self, sink: Sink, *, required: bool = False) -> bool:
        """Open a sink, send it the last REPLAYED events and feed it from now on.

        Args:
            sink: to open.
            required: raise the error of a sink that does not open, instead of removing the sink.

        Returns:
            Whether the sink opened.
        """
        number, self._attached = self._attached, self._attached + 1
        self._sinks[number] = sink
        if isinstance(sink, CommandSource):
            self._sources[number] = sink
        try:
            sink.open(self.info)
        except Exception as error:
            self._drop(number, error)
            if required:
                raise
        for event in self._past:
            self._call(number, sink.event, event)
        return number in self._sinks

    def advance(self, step: int, time: float) -> None:
        """Set step and robot time, seconds, of the following events and snapshots."""
        self._step, self._time = step, time

    def emit(
        self, kind: str, text: str, *, source: str, level: str = "info", **fields: Any
    ) -> Event:
        """Number and hash an event and send it to every sink.

        Raises:
            TypeError: a field is neither number, text, list nor mapping.
            ValueError: the level is unknown.
        """
        if level not in LEVELS:
            raise ValueError(f"level {level!r} is not one of {', '.join(LEVELS)}")
        event = Event(
            self.count, self._step, float(self._time), level, source, kind,
            without_local_details(text),
            json_value({name: _reproducible(value) for name, value in fields.items()}),
        )  # fmt: skip
        self._digest.update(event_line(event))
        self.count += 1
        self._past.append(event)
        for number, sink in list(self._sinks.items()):
            self._call(number, sink.event, event)
        self._tell_lost_links()
        return event

    def recent(self, count: int) -> tuple[Event, ...]:
        """The last few events, oldest first."""
        return tuple(self._past)[-count:] if count > 0 else ()

    def publish(self, make_snapshot: Callable[[], Snapshot]) -> None:
        """Send a snapshot to the sinks that want one; it is built only if there are any.

        This also reads incoming commands: a paused engine calls it ten times a second to stay
        reachable for dashboards.
        """
        wanting = {
            number: sink
            for number, sink in list(self._sinks.items())
            if self._call(number, sink.wants_snapshot, self._time)
        }
        if wanting:
            self._hand_out(wanting, make_snapshot())
        self._tell_lost_links()

    def service(self) -> None:
        """Answer connected clients; for long waits in which no snapshot can be made."""
        for number, source in list(self._sources.items()):
            self._call(number, source.service)
        self._tell_lost_links()

    def commands(self) -> list[Command]:
        """Return the commands since the last call, in order of arrival.

        Their ids are made unique across senders; pass them to `acknowledge` unchanged.
        """
        found: list[Command] = []
        for number, source in list(self._sources.items()):
            for command in self._call(number, source.commands) or ():
                found.append(replace(command, id=f"{number}:{command.id}"))
        self._tell_lost_links()
        return found

    def operator_silence(self) -> float:
        """Wall seconds since an operator was heard; 0 while none is connected."""
        heard = [self._call(number, one.silence) for number, one in list(self._sources.items())]
        return min((silent for silent in heard if silent is not None), default=0.0)

    def acknowledge(self, ack: Ack) -> None:
        """Send an acknowledgement to the sender of the command."""
        number, _, own = ack.id.partition(":")
        source = self._sources.get(int(number)) if number.isdecimal() else None
        if source is not None:
            self._call(int(number), source.acknowledge, replace(ack, id=own))

    def close(
        self, report: Mapping[str, Any] | None, make_snapshot: Callable[[], Snapshot] | None = None
    ) -> None:
        """Send the last snapshot to every sink, then close and remove all. Safe to call twice."""
        if make_snapshot is not None and self._sinks:
            self._hand_out(dict(self._sinks), make_snapshot())
        for number, sink in list(self._sinks.items()):
            self._call(number, sink.close, report)
        self._sinks.clear()
        self._sources.clear()
        self._lost_links.clear()

    def _hand_out(self, sinks: Mapping[int, Sink], snapshot: Snapshot) -> None:
        for number, sink in sinks.items():
            self._call(number, sink.snapshot, snapshot)

    def _call(self, number: int, method: Callable[..., Any], *arguments: Any) -> Any:
        """Call a sink's method unless the sink was removed; remove it if it raises."""
        if number not in self._sinks:
            return None
        try:
            return method(*arguments)
        except Exception as error:
            self._drop(number, error)
            return None

    def _tell_lost_links(self) -> None:
        """Emit an event for each link that failed, when no other event is being handed out."""
        while self._lost_links:
            link, reason = self._lost_links.pop(0)
            sentence = f"{link} lost: {reason}"
            fields = {"link": link, "reason": reason}
            self.emit("link_lost", sentence, source="telemetry", level="warning", **fields)

    def _drop(self, number: int, error: Exception) -> None:
        sink = self._sinks.pop(number)
        self._sources.pop(number, None)
        name = type(sink).__name__
        if isinstance(error, RecordFull):
            self._warn(f"! at {self._time:.1f} s {error}")
        elif isinstance(sink, RecordSink):
            event = self.count - 1 if sink.record == EVENTS else None
            self.lose(sink.record, reason_of(error), event)
        else:
            self._log(f"{name} failed and was removed: {type(error).__name__}: {error}")
            if isinstance(sink, LinkSink):
                self._lost_links.append((sink.link, reason_of(error)))
        try:
            sink.close(None)
        except Exception as again:
            self._log(f"{name} could not be closed: {type(again).__name__}: {again}")
