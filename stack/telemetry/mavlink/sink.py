"""The vehicle as a sink of a run: it sends telemetry to stations and takes their commands.

The link has a thread of its own, so that stations get heartbeats and answers whatever the engine
does. The engine's thread only hands over snapshots, events and acknowledgements. The thread rests
REST times as long as it has computed, so that a flood of frames does not slow the loop down.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from time import monotonic, thread_time  # noqa: TID251 - heartbeats belong to the transport
from typing import Any

from stack.errors import InputError
from stack.mavlink.address import read_address
from stack.mavlink.link import Link, opening_problem
from stack.mavlink.signing import Signing, read_key, signed_codecs, stamp_file
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.vehicle import COMPONENT, SYSTEM, Vehicle
from stack.telemetry.records import Ack, Command, Event, RunInfo, Snapshot

SNAPSHOT_PERIOD = 0.05
"""Wall seconds between two snapshots for the link."""

CYCLE = 0.01
"""Wall seconds that the thread waits for frames."""

REST, LONGEST_REST = 9.0, 0.4
CLOSING_TIME = 2.0
"""Wall seconds that `close` waits for the thread."""


class MavlinkVehicle:
    """Shows a run to MAVLink stations as a ground rover, and lets them command it.

    Args:
        address: udpout:HOST:PORT, udpin:HOST:PORT, tcp:…, tcpin:… or serial:DEVICE[:BAUD].
        key: file of the key with which all frames are signed; only then may the address listen to
            other machines. None: frames are not signed.
        home_item: `auto`, `always` or `never`: whether the first item of a plan is home.
        clock: returns wall seconds.

    Raises:
        InputError: the address is wrong or not allowed, its port is in use, its host is unknown,
            its device does not exist, the key cannot be used, or a library is missing.
    """

    link = "MAVLink"

    def __init__(
        self, address: str, *, key: Path | None = None, home_item: str = "auto",
        clock: Callable[[], float] = monotonic,
    ) -> None:  # fmt: skip
        self._handover, self._clock = Handover(), clock
        self._home_item = home_item
        read = read_address(address, signed=key is not None)
        self._signing = None if key is None else Signing(read_key(key), store=stamp_file(key))
        codecs = None if self._signing is None else signed_codecs(self._signing)
        try:
            self._link = Link(
                read, system=SYSTEM, component=COMPONENT, make_codec=codecs, clock=clock
            )
        except OSError as error:
            raise InputError(opening_problem(read, error)) from None
        self._thread: Thread | None = None
        self._ends = Flag()
        self._failure: Exception | None = None
        self._acks: list[Ack] = []
        self._last_snapshot = -SNAPSHOT_PERIOD

    def open(self, info: RunInfo) -> None:
        """Start the thread of the link."""
        vehicle = Vehicle(
            self._handover, self._link, self._clock, origin=info.origin,
            home_item=self._home_item, identity=info.identity,
        )  # fmt: skip
        self._thread = Thread(target=self._run, args=(vehicle,), name="MAVLink", daemon=True)
        self._thread.start()

    def event(self, event: Event) -> None:
        """Hand over an event."""
        self._handover.events.append(event)

    def wants_snapshot(self, time: float) -> bool:
        """Whether SNAPSHOT_PERIOD has passed, or a command was applied since the last snapshot.

        Raises:
            OSError: the connection or device is gone.
        """
        if self._failure is not None:
            raise self._failure
        return bool(self._acks) or self._clock() - self._last_snapshot >= SNAPSHOT_PERIOD

    def snapshot(self, snapshot: Snapshot) -> None:
        """Hand over a snapshot, then the acknowledgements of commands with their effect in it."""
        self._last_snapshot = self._clock()
        self._handover.snapshot = snapshot
        self._handover.acks.extend(self._acks)
        self._acks.clear()

    def service(self) -> None:
        """Nothing to do: the thread answers stations."""

    def commands(self) -> list[Command]:
        """Return the commands of stations since the last call."""
        return self._handover.take_commands()

    def silence(self) -> float | None:
        """Wall seconds since a ground station was heard; None before the first."""
        heard = self._handover.heard
        return None if heard is None else self._clock() - heard

    def acknowledge(self, ack: Ack) -> None:
        """Keep an acknowledgement until the next snapshot."""
        self._acks.append(ack)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Send the last state, and close the link. Safe to call twice."""
        self._ends.set()
        if self._thread is not None:
            self._thread.join(CLOSING_TIME)
            self._thread = None
        self._link.close()
        if self._signing is not None:
            self._signing.close()

    def _run(self, vehicle: Vehicle) -> None:
        """Serve stations until the end of the run."""
        try:
            while not self._ends.is_set():
                begun = thread_time()
                for received in self._link.receive(CYCLE):
                    vehicle.take(received.message)
                vehicle.tick()
                self._ends.wait(min(REST * (thread_time() - begun), LONGEST_REST))
            vehicle.tick()
        except Exception as error:  # told by the engine's thread: the event `link_lost`
            self._failure = error
