"""Client of TelemetryServer, used by dashboards. Independent of the stack."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable, Mapping
from contextlib import suppress
from math import ceil
from time import monotonic  # noqa: TID251 - transport timeouts are wall time
from typing import Any

from stack.errors import TelemetryError
from stack.telemetry.codec import decode, decode_one_of, encode
from stack.telemetry.messages import (
    SERVER_SENDS,
    EventBatch,
    Goodbye,
    Moment,
    NamedLayer,
    Over,
    Request,
    Served,
)
from stack.telemetry.records import Ack, Command, Event, Layer, RunInfo, Snapshot
from stack.telemetry.rendezvous import RunHandle
from stack.types import Image

REQUEST_TIMEOUT = 2.0
"""Wall seconds of silence after which an unanswered request is repeated."""

LINGER_MS = 200
"""Longest time that closing waits for the last command to be sent."""

MAX_RECEIVED = 1000
"""Messages read in one `poll`, so that the dashboard stays responsive during a backlog."""


class TelemetryClient:
    """Connection to one run: snapshots, events, commands. No method blocks but `wait`.

    Attributes:
        run: the run that it is connected to; commands are meant for this one only.
        info: constant data of the run; None until the engine has answered.
        report: content of report.json; None until the run is over, or after a crash.
        is_over: the engine has reported the end of the run.
        has_all_events: all events that had happened when the engine last answered are received.
        missed_events: events that the engine had discarded before this client connected.
        pictures: whether the camera's pictures are wanted; snapshots then have the newest one.
    """

    def __init__(self, run: RunHandle, clock: Callable[[], float] = monotonic) -> None:
        """Connect to a run.

        Args:
            run: a live run.
            clock: returns wall seconds.

        Raises:
            TelemetryError: the address is not local (ipc://…).
        """
        if not run.address.startswith("ipc://"):
            raise TelemetryError(
                f"cannot connect to {run.address!r}: expected ipc://… of a live run"
            )
        import zmq

        self.run = run
        self.info: RunInfo | None = None
        self.report: dict[str, Any] | None = None
        self.is_over = self.has_all_events = False
        self.missed_events = 0
        self.pictures = False
        self._picture: Image | None = None
        self._clock = clock
        self._newest: Snapshot | None = None
        self._moment, self._next_event = -1, 0
        self._layers: dict[str, Layer] = {}
        self._events: list[Event] = []
        self._acks: list[Ack] = []
        self._sleepers: list[asyncio.Event] = []
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket: zmq.Socket[bytes] = self._context.socket(zmq.DEALER)
        self._socket.set(zmq.LINGER, LINGER_MS)
        self._socket.connect(run.address)
        self._heard = self._requested = clock()
        self._request()

    @property
    def silent_for(self) -> float:
        """Wall seconds since the last message of the engine."""
        return self._clock() - self._heard

    def poll(self) -> Snapshot | None:
        """Read incoming messages; return the newest snapshot since the last call, with layers.

        Raises:
            TelemetryError: the engine uses another telemetry version.
        """
        self._receive()
        newest, self._newest = self._newest, None
        return newest

    def wait(self, seconds: float) -> None:
        """Sleep until a message has arrived, at most so many wall seconds."""
        self._socket.poll(ceil(1000.0 * seconds))

    async def wait_async(self, seconds: float) -> None:
        """Do the same in an event loop of asyncio; wakes too when another coroutine receives."""
        import zmq

        loop, descriptor = asyncio.get_running_loop(), int(self._socket.get(zmq.FD))
        arrived = asyncio.Event()
        if not self._sleepers:
            loop.add_reader(descriptor, self._wake)
        self._sleepers.append(arrived)
        try:
            if not int(self._socket.get(zmq.EVENTS)) & zmq.POLLIN:
                with suppress(TimeoutError):
                    await asyncio.wait_for(arrived.wait(), seconds)
        finally:
            self._sleepers.remove(arrived)
            if not self._sleepers:
                loop.remove_reader(descriptor)

    def _wake(self) -> None:
        for arrived in self._sleepers:
            arrived.set()

    def events(self) -> list[Event]:
        """Return the events since the last call: in order, without gaps, from number 0 on."""
        self._receive()
        taken, self._events = self._events, []
        return taken

    def acks(self) -> list[Ack]:
        """Return the acknowledgements since the last call."""
        self._receive()
        taken, self._acks = self._acks, []
        return taken

    def send(self, command: Command) -> None:
        """Send a command to this run; `acks` returns its acknowledgement.

        The command carries the run's identity: an engine refuses those of another run.

        Raises:
            TelemetryError: the engine does not accept messages, or the run is over.
        """
        import zmq

        if self.is_over:
            raise TelemetryError(f"cannot {command.kind}: the run is over")
        try:
            self._socket.send(
                encode(dataclasses.replace(command, run=self.run.identity)), zmq.NOBLOCK
            )
        except zmq.Again:
            raise TelemetryError(f"cannot {command.kind}: the engine does not answer") from None

    def close(self) -> None:
        """Say goodbye and disconnect; the run continues. Safe to call twice."""
        import zmq

        if self._socket.closed:
            return
        if not self.is_over:
            with suppress(zmq.Again):  # the engine does not read; it displaces silent clients
                self._socket.send(encode(Goodbye()), zmq.NOBLOCK)
        self._socket.close()
        self._context.term()

    def _request(self) -> None:
        import zmq

        versions = {name: layer.version for name, layer in self._layers.items()}
        request = Request(
            self.info is not None, self._next_event, self._moment, versions, self.pictures
        )  # fmt: skip
        self._requested = self._clock()
        try:
            self._socket.send(encode(request), zmq.NOBLOCK)
        except zmq.Again:
            return  # the engine does not read; requested again after REQUEST_TIMEOUT

    def _receive(self) -> None:
        import zmq

        if self._socket.closed:
            return
        for _ in range(MAX_RECEIVED):
            try:
                encoded = self._socket.recv(zmq.NOBLOCK)
            except zmq.Again:
                break
            self._heard = self._clock()
            self._wake()
            self._take(decode_one_of(encoded, SERVER_SENDS))
        now = self._clock()
        if not self.is_over and min(now - self._heard, now - self._requested) > REQUEST_TIMEOUT:
            self._request()

    def _take(self, message: Any) -> None:
        match message:
            case RunInfo():
                self.info = message
            case NamedLayer():
                self._layers[message.name] = message.layer
            case Image():
                self._picture = message
            case Moment():
                self._show(message)
            case EventBatch():
                self._append(message)
            case Ack():
                self._acks.append(message)
            case Served():
                self.has_all_events = self._next_event >= message.events
                if not self.is_over:
                    self._request()
            case Over():
                self.is_over = True
                self.report = dict(message.report) if isinstance(message.report, Mapping) else None

    def _show(self, moment: Moment) -> None:
        layers = {
            name: self._layers[name]
            for name, version in moment.layers.items()
            if name in self._layers and self._layers[name].version == version
        }
        self._moment = moment.number
        self._newest = dataclasses.replace(moment.snapshot, layers=layers, image=self._picture)

    def _append(self, batch: EventBatch) -> None:
        if batch.first > self._next_event:
            self.missed_events += batch.first - self._next_event
            self._next_event = batch.first
        for encoded in batch.events[self._next_event - batch.first :]:
            self._events.append(decode(encoded, Event))
            self._next_event += 1
