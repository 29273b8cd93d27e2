"""Runs a rover link beside the step loop, in a thread, until a process of its own does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from threading import Event, Lock, Thread
from time import monotonic  # noqa: TID251 - a real robot's clock

from robots.mavlink.rover_link import STAND, Order, RoverLink
from stack.body import DEAD_MAN
from stack.mavlink.link import Received

CYCLE = 0.02
"""Seconds between two cycles without messages."""

KEPT = 5000
"""Messages that wait for the step loop; of more, the oldest are dropped."""

CLOSING = 3.0
"""Seconds that the thread gets to end."""


class LinkThread:
    """Calls `RoverLink.cycle` with the newest order; stops the rover when the loop gives none.

    Args:
        link: from now on only this thread calls its `cycle`.
        clock: returns seconds.
    """

    def __init__(self, link: RoverLink, clock: Callable[[], float] = monotonic) -> None:
        self.link, self._clock = link, clock
        self._order, self._ordered_at = STAND, clock()
        self._received: deque[Received] = deque(maxlen=KEPT)
        self._lock, self._ending = Lock(), Event()
        self._failure: BaseException | None = None
        self._thread = Thread(target=self._run, name="mavlink", daemon=True)
        self._thread.start()

    def order(self, order: Order) -> None:
        """Order what holds for the next DEAD_MAN seconds."""
        with self._lock:
            self._order, self._ordered_at = order, self._clock()

    def take(self) -> list[Received]:
        """Return the messages since the last call.

        Raises:
            BaseException: what ended the thread.
        """
        if self._failure is not None:
            raise self._failure
        return [self._received.popleft() for _ in range(len(self._received))]

    def close(self) -> None:
        """End the thread and close the link. Safe to call twice."""
        self._ending.set()
        self._thread.join(CLOSING)
        self.link.close()

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                began = self._clock()
                self._received.extend(self.link.cycle(began, self._current(began), CYCLE))
                if self._clock() - began < 1e-4:  # no link to wait for
                    self._ending.wait(CYCLE)
        except BaseException as error:
            self._failure = error

    def _current(self, now: float) -> Order:
        """The newest order, or standstill when it is too old."""
        with self._lock:
            order, age = self._order, now - self._ordered_at
        return order if age <= DEAD_MAN else replace(order, linear=0.0, angular=0.0)
