"""A relay of datagrams between a vehicle and a station that loses some of them."""

from __future__ import annotations

import random
import select
import socket
from threading import Event, Thread


def free_port() -> int:
    """A UDP port of this machine that is free now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class LossyRelay:
    """Passes datagrams on in both directions, in a thread.

    Attributes:
        port: to which the vehicle sends; the station listens at `station`.
        loss: probability that a datagram is lost.
        lost: number of datagrams that were.
    """

    def __init__(self, station: int) -> None:
        self.loss, self.lost = 0.0, 0
        self._near = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._near.bind(("127.0.0.1", 0))
        self.port = int(self._near.getsockname()[1])
        self._far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._far.bind(("127.0.0.1", 0))
        self._station, self._vehicle = ("127.0.0.1", station), None
        self._chance, self._ends = random.Random(1), Event()
        self._thread = Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._ends.is_set():
            ready, _, _ = select.select([self._near, self._far], [], [], 0.05)
            for source in ready:
                try:
                    data, sender = source.recvfrom(65536)
                except ConnectionError:  # nobody listens yet
                    continue
                if source is self._near:
                    self._vehicle = sender
                self._pass_on(data, from_vehicle=source is self._near)

    def _pass_on(self, data: bytes, *, from_vehicle: bool) -> None:
        if self._chance.random() < self.loss:
            self.lost += 1
        elif from_vehicle:
            self._far.sendto(data, self._station)
        elif self._vehicle is not None:
            self._near.sendto(data, self._vehicle)

    def close(self) -> None:
        self._ends.set()
        self._thread.join()
        self._near.close()
        self._far.close()
