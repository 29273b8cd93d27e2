"""Sink that shows a run live to Foxglove, over a WebSocket. It imports foxglove when it opens."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from threading import Event as Flag
from typing import TYPE_CHECKING, Any

from stack.errors import InputError
from stack.optional_packages import FOXGLOVE
from stack.schedule import Schedule
from stack.telemetry.records import Event, RunInfo, Snapshot
from stack.telemetry.sinks import Sink
from stack.telemetry.snapshots.format import LAYER_PERIODS

if TYPE_CHECKING:
    from stack.telemetry.foxglove.drawing import FoxgloveDrawing

HOST = "127.0.0.1"
"""The server has neither keys nor passwords: other machines reach it through SSH only."""

PERIOD = 0.2
"""Robot time between two snapshots, s."""

FLUSHING = 0.3
"""Wall seconds that are left to send the end of a run."""

BACKLOG = 128
"""Messages that wait for a slow client at most; then it loses the oldest."""


class FoxgloveServer(Sink):
    """Shows the run to Foxglove's apps on this machine; they cannot command it.

    Messages are made for topics that somebody reads. The library's threads send them: a client that
    does not read loses messages and delays nothing.

    Args:
        port: on the loopback device.

    Raises:
        InputError: the port is in use, or foxglove-sdk is not installed.
    """

    link = "Foxglove"

    def __init__(self, port: int) -> None:
        FOXGLOVE.require("--foxglove needs")
        self._port = port
        try:
            socket.create_server((HOST, port)).close()
        except OSError as error:
            reason = os.strerror(error.errno or 0)
            raise InputError(
                f"--foxglove {port}: cannot listen on port {port} of {HOST}: {reason};"
                " choose another port"
            ) from None
        self._snapshots, self._newcomer = Schedule(PERIOD), Flag()
        self._subscriptions = _Subscriptions(self._newcomer)
        self._server: Any = None
        self._drawing: FoxgloveDrawing | None = None

    def open(self, info: RunInfo) -> None:
        """Start the server.

        Raises:
            RuntimeError: another program has taken the port.
        """
        import foxglove

        from stack.telemetry.foxglove.drawing import FoxgloveDrawing

        context = foxglove.Context()
        listener: Any = self._subscriptions  # the library asks for more methods
        self._server = foxglove.start_server(
            name=info.title or info.mission,
            host=HOST,
            port=self._port,
            context=context,
            session_id=info.identity,
            message_backlog_size=BACKLOG,
            server_listener=listener,
        )
        self._drawing = FoxgloveDrawing(info, context, LAYER_PERIODS)

    def event(self, event: Event) -> None:
        """Send an event to those who are connected."""
        assert self._drawing is not None, "opened"
        self._drawing.event(event)

    def wants_snapshot(self, time: float) -> bool:
        """Whether a period of robot time has passed, or somebody has subscribed to a topic."""
        return self._newcomer.is_set() or self._snapshots.is_due(time)

    def snapshot(self, snapshot: Snapshot) -> None:
        """Send what changed; to somebody new, all."""
        assert self._drawing is not None, "opened"
        self._snapshots.take(snapshot.time)
        if self._newcomer.is_set():
            self._newcomer.clear()
            self._drawing.forget()
        self._drawing.draw(snapshot)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Send what waits and stop the server. Safe to call twice."""
        server, self._server = self._server, None
        if server is not None:
            if self._subscriptions.is_anybody:
                Flag().wait(FLUSHING)  # the library drops what it has not sent when it stops
            server.stop()


class _Subscriptions:
    """Notes new subscriptions; called from the server's threads."""

    def __init__(self, newcomer: Flag) -> None:
        self._newcomer, self.is_anybody = newcomer, False

    def on_subscribe(self, client: object, channel: object) -> None:
        """Somebody has subscribed to a topic."""
        self.is_anybody = True
        self._newcomer.set()

    def on_unsubscribe(self, client: object, channel: object) -> None:
        """Nothing is made for a topic that nobody reads."""
