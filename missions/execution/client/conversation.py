"""Questions to an engine and waiting for its answers: the part below both kinds of connection."""

from __future__ import annotations

from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Mapping
from contextlib import asynccontextmanager
from time import monotonic  # noqa: TID251 - waiting for another process
from typing import Any, TypeVar
from uuid import uuid4

from stack.errors import InputError, TelemetryError
from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import Ack, Command, Event, RunInfo, Snapshot
from stack.telemetry.rendezvous import RunHandle, is_alive

ANSWER_TIMEOUT = 10.0
"""Wall seconds that an engine may take to answer: compiling an optimiser takes several."""

LOOK_PERIOD = 0.5
"""Wall seconds after which a silent engine is looked for; nothing else is done at this rate."""

KEPT_EVENTS = 100_000
"""Events that wait to be read; older ones are discarded."""

T = TypeVar("T")

Wait = Callable[[TelemetryClient, float], Awaitable[None]]
"""Waits for a message, at most so many wall seconds."""


class _RunEnded(TelemetryError):
    """The run has ended in order."""


class _NotInTime(TelemetryError):
    """What was waited for has not come in time from an engine that answers."""


class CommandRefused(InputError):
    """The engine has refused a command; the text is its reason."""


def finished(coroutine: Coroutine[Any, Any, T]) -> T:
    """Return the result of a coroutine that blocks where others would suspend."""
    try:
        coroutine.send(None)
    except StopIteration as stop:
        result: T = stop.value
        return result
    coroutine.close()
    raise RuntimeError("the coroutine has suspended")


async def sleep_until_message(client: TelemetryClient, seconds: float) -> None:
    """The Wait that blocks."""
    client.wait(seconds)


async def await_message(client: TelemetryClient, seconds: float) -> None:
    """The Wait that lets other coroutines run."""
    await client.wait_async(seconds)


class Conversation:
    """Asks one engine and waits for what it answers.

    Args:
        run: a live run.
        timeout: wall seconds that the engine may take to answer.
        wait: how to wait.
    """

    def __init__(self, run: RunHandle, timeout: float, wait: Wait) -> None:
        self.run, self.timeout = run, timeout
        self._wait, self._client = wait, TelemetryClient(run)
        self._newest: Snapshot | None = None
        self._snapshots = 0
        self._awaited: dict[str, Ack | Event | None] = {}
        self._waiting: deque[Event] = deque(maxlen=KEPT_EVENTS)

    def close(self) -> None:
        """Disconnect; the run continues. Safe to call twice."""
        self._client.close()

    async def begin(self) -> None:
        """Wait for the description and the state of the run; forget the events before."""

        await self._until(lambda: self._client.info, "the first answer", self.timeout)
        await self._until(self._has_all, "the events before", self.timeout)
        self._waiting.clear()

    @property
    def info(self) -> RunInfo:
        """Description of the run."""
        assert self._client.info is not None
        return self._client.info

    async def snapshot(self) -> Snapshot:
        """A snapshot that is not older than the call; the last one of a run that has ended."""
        return await self.next_snapshot() or self._last()

    async def next_snapshot(self) -> Snapshot | None:
        """The next snapshot; None after the end of the run."""
        self._receive()  # what has waited unread is older than the call
        known = self._snapshots

        def look() -> Snapshot | None:
            return self._newest if self._snapshots > known else None

        try:
            return await self._until(look, "a snapshot", self.timeout)
        except _RunEnded:
            return None

    async def next_event(self, timeout: float) -> Event | None:
        """The next event; None after the end of the run, or without one in so many wall seconds."""

        def look() -> Event | None:
            return self._waiting.popleft() if self._waiting else None

        try:
            return await self._until(look, "an event", timeout)
        except (_RunEnded, _NotInTime):
            return None

    async def command(self, kind: str, arguments: Mapping[str, Any]) -> str:
        """Send a command and return the engine's answer.

        Raises:
            CommandRefused: the engine has refused it.
        """
        command = Command(uuid4().hex, kind, arguments)
        self._receive()  # a run that has ended refuses what is sent
        async with self._awaiting(command.id) as answered:
            self._client.send(command)
            ack = await self._until(answered, f"the answer to {kind}", self.timeout)
        if not ack.done:
            raise CommandRefused(f"{kind}: {ack.reason}")
        return ack.reason or "done"

    async def detour(self, kind: str, arguments: Mapping[str, Any], timeout: float) -> Event:
        """Send a command that begins a detour; return the event of its end.

        Raises:
            CommandRefused: the engine has refused it.
        """
        tag = uuid4().hex[:8]
        async with self._awaiting(tag) as ended:
            await self.command(kind, {**arguments, "tag": tag})
            event: Event = await self._until(ended, f"the end of {kind}", timeout)
            return event

    @asynccontextmanager
    async def _awaiting(self, name: str) -> AsyncIterator[Callable[[], Any]]:
        """Keep what answers to a name, for one of several coroutines."""
        self._awaited[name] = None
        try:
            yield lambda: self._awaited[name]
        finally:
            del self._awaited[name]

    def _receive(self) -> None:
        newest = self._client.poll()
        if newest is not None:
            self._newest, self._snapshots = newest, self._snapshots + 1
        for ack in self._client.acks():
            if ack.id in self._awaited:
                self._awaited[ack.id] = ack
        for event in self._client.events():
            self._waiting.append(event)
            tag = event.fields.get("tag")
            if event.kind == "detour" and tag in self._awaited:
                self._awaited[tag] = event

    def _has_all(self) -> bool | None:
        return True if self._client.has_all_events and self._newest is not None else None

    def _last(self) -> Snapshot:
        if self._newest is None:
            raise TelemetryError(f"{self._name} has ended, before a snapshot")
        return self._newest

    async def _until(self, look: Callable[[], T | None], what: str, timeout: float) -> T:
        """Wait until `look` finds something; it is asked after each message.

        Raises:
            _RunEnded: the run has ended in order.
            _NotInTime: the engine answers, but not with this.
            TelemetryError: the engine has died, or does not answer.
        """
        began = monotonic()
        while True:
            self._receive()
            if (found := look()) is not None:
                return found
            if self._client.is_over:
                raise _RunEnded(f"{self._name} has ended, before {what}")
            waited = monotonic() - began
            silent = min(waited, self._client.silent_for)  # nobody has read before
            if silent > LOOK_PERIOD / 2.0 and not is_alive(self.run):
                raise TelemetryError(f"{self._name} has died: its process has ended")
            if silent >= self.timeout:
                raise TelemetryError(
                    f"the engine of {self._name} has not answered for {self.timeout:g} s"
                )
            if waited >= timeout:
                raise _NotInTime(f"{self._name} has not sent {what} within {timeout:g} s")
            await self._wait(self._client, min(timeout - waited, LOOK_PERIOD))

    @property
    def _name(self) -> str:
        return f"the run {self.run.run_id}"
