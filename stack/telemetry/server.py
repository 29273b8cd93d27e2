"""Telemetry server: dashboards in other processes watch and command a run over ZeroMQ.

It has one ROUTER socket, which takes the messages of the clients in turn: none can crowd out
another. All work is done in calls from the engine's thread and in ZeroMQ's background thread; no
call blocks.
"""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic  # noqa: TID251 - transport timeouts are wall time
from typing import TYPE_CHECKING, Any

from stack.errors import TelemetryError
from stack.telemetry.codec import decode_one_of, encode
from stack.telemetry.event_log import json_value
from stack.telemetry.inbox import STOP, CommandInbox
from stack.telemetry.messages import (
    CLIENT_SENDS,
    EventBatch,
    Goodbye,
    Inquiry,
    Moment,
    NamedLayer,
    Over,
    Request,
    RunState,
    Served,
)
from stack.telemetry.records import Ack, Command, Event, RunInfo, Snapshot
from stack.telemetry.rendezvous import RunHandle, announce, announce_again, withdraw
from stack.telemetry.small_picture import small_picture

if TYPE_CHECKING:
    import zmq

PERIOD = 0.05
"""Shortest time between two answers to one client, wall seconds: twenty snapshots a second."""

ANNOUNCE_PERIOD, ALIVE_PERIOD = 1.0, 0.5
"""Wall seconds between two checks whether the run can still be found; wall seconds after which a
client is answered even if there is nothing new."""

KEPT_EVENTS = 200_000
BATCH = 2000
"""Events in one message."""

PICTURE_PERIOD = 0.5  # wall seconds between two pictures to one client
MAX_CLIENTS = 32
SILENT_AFTER = 2.0
"""Wall seconds without a message and an open request after which a new client may take its place.
A client that receives its answers requests again at once."""

MAX_REQUEST_BYTES = 1 << 16
MAX_RECEIVED = 100
"""Messages read in one call, so that a flood of messages cannot block the engine."""

MAX_UNREAD, MAX_UNSENT = 200, 400
"""Messages that wait in memory from one client, and for one client."""

LINGER_MS = 1000
"""Longest time that closing waits for the last messages to be sent."""


@dataclass
class _Client:
    """State of one connection.

    Attributes:
        heard: wall time of its last message.
        answered: wall time of the last answer, -1 before the first.
        pending: request that is not answered yet.
        asks: an Inquiry is not answered yet.
        has: what the client has after the last answer.
        picture: wall time of the last picture, and its stamp.
    """

    heard: float
    answered: float = -1.0
    pending: Request | None = None
    asks: bool = False
    has: Request = dataclasses.field(default_factory=Request)
    picture: tuple[float, float] = (-1.0, -1.0)


class TelemetryServer:
    """Sink that dashboards of the same user connect to.

    Attributes:
        handle: descriptor of the run with its address; None until opened.
    """

    link = "control by dashboards and `treepilot tell`"

    def __init__(self, clock: Callable[[], float] = monotonic, folder: Path | None = None) -> None:
        """Prepare a server with a socket in the user's own folder of sockets.

        Args:
            clock: returns wall seconds.
            folder: of the run, which is announced; None if it has none.
        """
        self.handle: RunHandle | None = None
        self._clock, self._folder = clock, folder
        self._socket: zmq.Socket[bytes] | None = None
        self._context: zmq.Context[zmq.Socket[bytes]] | None = None
        self._clients: dict[bytes, _Client] = {}
        self._inbox: CommandInbox | None = None
        self._events: deque[bytes] = deque(maxlen=KEPT_EVENTS)
        self._event_count = 0
        self._info, self._identity = b"", ""
        self._newest: Snapshot | None = None
        self._moment, self._looked = -1, clock()
        self._encoded_moment: bytes | None = None
        self._encoded_layers: dict[str, tuple[int, bytes]] = {}

    @property
    def watchers(self) -> int:
        """Number of connected clients."""
        return len(self._clients)

    def open(self, info: RunInfo) -> None:
        """Announce the run and bind the socket.

        Raises:
            TelemetryError: there is no private folder for the socket, or it cannot be bound.
        """
        import zmq

        self._info, self._inbox = encode(info), CommandInbox(info, self._clock)
        self._identity = info.identity
        self.handle = announce(info, self._folder)
        self._context = zmq.Context()
        socket: zmq.Socket[bytes] = self._context.socket(zmq.ROUTER)
        socket.set(zmq.LINGER, LINGER_MS)
        socket.set(zmq.MAXMSGSIZE, MAX_REQUEST_BYTES)
        socket.set(zmq.ROUTER_MANDATORY, 1)
        socket.set(zmq.RCVHWM, MAX_UNREAD)
        socket.set(zmq.SNDHWM, MAX_UNSENT)
        self._socket = socket
        try:
            socket.bind(self.handle.address)
        except zmq.ZMQError as error:
            raise TelemetryError(f"cannot open {self.handle.socket}: {error}") from None

    def event(self, event: Event) -> None:
        """Keep an event until clients request it."""
        self._events.append(encode(event))
        self._event_count = event.number + 1

    def wants_snapshot(self, time: float) -> bool:
        """Whether a client's request is pending and PERIOD has passed since its last answer."""
        self._receive()
        return any(True for _ in self._due())

    def snapshot(self, snapshot: Snapshot) -> None:
        """Keep the newest snapshot and answer the clients that are due."""
        self._newest, self._moment, self._encoded_moment = snapshot, self._moment + 1, None
        for identity, client in list(self._due()):
            if client.asks:
                self._tell_state(identity, client, snapshot)
            if client.pending is not None:
                self._answer(identity, client)

    def service(self) -> None:
        """Answer clients that are due with the newest data."""
        self._receive()
        now = self._clock()
        for identity, client in list(self._due()):
            if client.pending is None:
                continue
            if self._has_news(client) or now - client.answered >= ALIVE_PERIOD:
                self._answer(identity, client)

    def commands(self) -> list[Command]:
        """Return the next commands to apply; emergency stops come first.

        Their ids are made unique across clients.
        """
        self._receive()
        assert self._inbox is not None
        return self._inbox.take()

    def silence(self) -> float | None:
        """Wall seconds since a client was heard; None if all have said goodbye."""
        now = self._clock()
        return min((now - client.heard for client in self._clients.values()), default=None)

    def acknowledge(self, ack: Ack) -> None:
        """Send an Ack to the client whose command it was."""
        assert self._inbox is not None
        addressed = self._inbox.addressed(ack)
        if addressed is not None:
            self._send_ack(*addressed)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Send every client the data it lacks and the end of the run; close and withdraw."""
        socket, context = self._socket, self._context
        try:
            if socket is not None:
                self._receive()
                self._end(encode(Over(None if report is None else json_value(report))))
        finally:
            self._socket = self._context = None
            if socket is not None:
                socket.close()
            if context is not None:
                context.term()
            if self.handle is not None:
                withdraw(self.handle)

    def _end(self, over: bytes) -> None:
        for identity, client in list(self._clients.items()):
            while self._answer(identity, client) and client.has.next_event < self._event_count:
                pass
            self._send(identity, over)

    def _receive(self) -> None:
        """Read the messages of clients."""
        import zmq

        assert self._socket is not None
        if self._clock() - self._looked >= ANNOUNCE_PERIOD:
            self._looked = self._clock()
            self._stay_announced()
        for _ in range(MAX_RECEIVED):
            if not int(self._socket.get(zmq.EVENTS)) & zmq.POLLIN:
                return
            frames = self._socket.recv_multipart(zmq.NOBLOCK)
            if len(frames) == 2:
                self._take(*frames)

    def _stay_announced(self) -> None:
        """Announce the run again if its files were deleted; connected clients notice nothing."""
        import zmq

        assert self._socket is not None and self.handle is not None
        if self.handle.descriptor.exists() and self.handle.socket.exists():
            return
        with suppress(TelemetryError, zmq.ZMQError):  # the next attempt comes in a second
            self.handle = announce_again(self.handle)
            self._socket.bind(self.handle.address)

    def _take(self, identity: bytes, encoded: bytes) -> None:
        try:
            message = decode_one_of(encoded, CLIENT_SENDS)
        except TelemetryError:
            # A client of another version detects this by the stamp of any answer.
            self._send(identity, encode(Served(self._event_count)))
            return
        if isinstance(message, Goodbye):
            self._clients.pop(identity, None)
            return
        client = self._client(identity)
        if isinstance(message, Command):
            self._take_command(identity, message, has_place=client is not None)
        elif client is None:
            return
        elif isinstance(message, Inquiry):
            client.asks = True
        else:
            client.pending = client.has = message

    def _take_command(self, identity: bytes, command: Command, *, has_place: bool) -> None:
        """Pass a command on; a client without a place can only trigger the emergency stop."""
        assert self._inbox is not None
        if not has_place and command.kind != STOP:
            refusal = f"{MAX_CLIENTS} clients are connected already; close one of them"
            self._send_ack(identity, Ack(command.id, False, refusal))
            return
        for sender, ack in self._inbox.receive(identity, command):
            self._send_ack(sender, ack)

    def _client(self, identity: bytes) -> _Client | None:
        """The client with this identity, created if new; None if there are too many."""
        now = self._clock()
        if identity not in self._clients:
            if len(self._clients) >= MAX_CLIENTS and not self._displace(now):
                return None
            self._clients[identity] = _Client(now)
        client = self._clients[identity]
        client.heard = now
        return client

    def _displace(self, now: float) -> bool:
        """Forget the client that has been silent for longest; return whether one was silent."""
        silent = [
            (client.heard, identity)
            for identity, client in self._clients.items()
            if client.pending is None and now - client.heard > SILENT_AFTER
        ]
        if silent:
            del self._clients[min(silent)[1]]
        return bool(silent)

    def _due(self) -> Iterator[tuple[bytes, _Client]]:
        now = self._clock()
        for identity, client in self._clients.items():
            if (client.pending is not None or client.asks) and (
                client.answered < 0.0 or now - client.answered >= PERIOD
            ):
                yield identity, client

    def _has_news(self, client: _Client) -> bool:
        return (
            not client.has.has_info
            or client.has.next_event < self._event_count
            or client.has.moment < self._moment
        )

    def _answer(self, identity: bytes, client: _Client) -> bool:
        """Send a client the data it lacks; return whether it is still connected."""
        for message in self._news(client):
            if not self._send(identity, message):
                return False
        client.pending, client.answered = None, self._clock()
        return True

    def _tell_state(self, identity: bytes, client: _Client, snapshot: Snapshot) -> None:
        """Answer an Inquiry."""
        state = RunState(self._identity, snapshot.state, snapshot.time)
        if self._send(identity, encode(state)):
            client.asks, client.answered = False, self._clock()

    def _news(self, client: _Client) -> Iterator[bytes]:
        has = client.has
        if not has.has_info:
            yield self._info
        layers = dict(has.layers)
        if self._newest is not None and has.moment < self._moment:
            for name, layer in self._newest.layers.items():
                if layers.get(name) != layer.version:
                    layers[name] = layer.version
                    yield self._layer(name)
            yield from self._newest_picture(client)
            yield self._newest_moment()
        first = max(has.next_event, self._event_count - len(self._events))
        batch = self._batch(first)
        if batch:
            yield encode(EventBatch(first, batch))
        client.has = Request(True, first + len(batch), self._moment, layers, has.pictures)
        yield encode(Served(self._event_count))

    def _batch(self, first: int) -> tuple[bytes, ...]:
        """Up to BATCH encoded events, starting with this number."""
        kept, lacking = self._events, self._event_count - first
        return tuple(kept[n - lacking] for n in range(min(lacking, BATCH)))

    def _layer(self, name: str) -> bytes:
        assert self._newest is not None
        layer = self._newest.layers[name]
        cached = self._encoded_layers.get(name)
        if cached is None or cached[0] != layer.version:
            cached = layer.version, encode(NamedLayer(name, layer))
            self._encoded_layers[name] = cached
        return cached[1]

    def _newest_picture(self, client: _Client) -> Iterator[bytes]:
        """The newest picture, small, for a client that asks for pictures and lacks it."""
        image = self._newest.image if self._newest is not None else None
        sent, stamp = client.picture
        is_due = sent < 0.0 or self._clock() - sent >= PICTURE_PERIOD
        if client.has.pictures and is_due and image is not None and image.stamp != stamp:
            client.picture = self._clock(), image.stamp
            yield encode(small_picture(image))

    def _newest_moment(self) -> bytes:
        """Return the newest snapshot without its pictures."""
        if self._encoded_moment is None:
            newest = self._newest
            assert newest is not None
            versions = {name: layer.version for name, layer in newest.layers.items()}
            bare = dataclasses.replace(newest, layers={}, image=None, mask=None, depth_image=None)
            self._encoded_moment = encode(Moment(self._moment, versions, bare))
        return self._encoded_moment

    def _send_ack(self, identity: bytes, ack: Ack) -> None:
        """Send an Ack; a client that does not read its messages keeps its place and budget."""
        import zmq

        assert self._socket is not None
        with suppress(zmq.ZMQError):
            self._socket.send_multipart([identity, encode(ack)], zmq.NOBLOCK)

    def _send(self, identity: bytes, message: bytes) -> bool:
        """Send without waiting; remove a client that is gone or does not receive."""
        import zmq

        assert self._socket is not None
        try:
            self._socket.send_multipart([identity, message], zmq.NOBLOCK)
        except zmq.ZMQError:
            self._clients.pop(identity, None)
            return False
        return True
