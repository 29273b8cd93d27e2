"""Reads the sensors of a real robot: a thread for each, and the newest measurement of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from threading import Event, Lock, Thread
from time import monotonic  # noqa: TID251 - a real robot's clock
from typing import Any

from robots.sensor_drivers.kinds import SensorDriver, checked_parameters, driver_kind
from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError
from stack.types import Measurement

AGAIN, LONGEST_PAUSE = 0.5, 8.0
"""Seconds until a sensor that failed is opened again; doubled after each failure."""

CLOSING = 2.0
"""Seconds that a thread gets to end."""


class SensorReaders:
    """All sensors of a robot file's section `sensors`.

    Args:
        robot: with the drivers and the sensors that they read.
        clock: returns seconds; the measurements are stamped by it.
    """

    def __init__(self, robot: RobotDescription, clock: Callable[[], float] = monotonic) -> None:
        self._readers = [
            _Reader(
                name,
                driver_kind(kind)(robot.real_lidars[name], checked_parameters(kind, values), clock),
            )
            for name, (kind, values) in robot.sensor_drivers.items()
        ]  # fmt: skip

    def take(self, began: float, until: float) -> dict[str, Measurement]:
        """Return the new measurements by sensor name.

        Args:
            began: time of the clock that is 0 in the stamps of the result.
            until: time of the result; a later measurement waits.
        """
        found = {}
        for reader in self._readers:
            measured = reader.take(until)
            if measured is not None and measured.stamp > began:
                found[reader.name] = replace(measured, stamp=measured.stamp - began)
        return found

    @property
    def problem(self) -> str:
        """Which sensors do not work, and why; empty if all do."""
        wrong = [f"{reader.name}: {reader.problem}" for reader in self._readers if reader.problem]
        return "; ".join(wrong)

    def close(self) -> None:
        """End all threads. Safe to call twice."""
        for reader in self._readers:
            reader.ending.set()
        for reader in self._readers:
            reader.thread.join(CLOSING)


class _Reader:
    """One sensor and its thread."""

    def __init__(self, name: str, driver: SensorDriver) -> None:
        self.name, self.problem = name, ""
        self.ending = Event()
        self._driver, self._lock = driver, Lock()
        self._newest: Any = None
        self.thread = Thread(target=self._run, name=f"sensor {name}", daemon=True)
        self.thread.start()

    def take(self, until: float) -> Any:
        """The newest measurement that has not been taken; None if there is none."""
        with self._lock:
            if self._newest is None or self._newest.stamp > until:
                return None
            measured, self._newest = self._newest, None
        return measured

    def _run(self) -> None:
        pause = AGAIN
        while not self.ending.is_set():
            try:
                self._driver.open()
                while not self.ending.is_set():
                    measured = self._driver.read()
                    if measured is not None:
                        pause, self.problem = AGAIN, ""
                        with self._lock:
                            self._newest = measured
            except (OSError, BodyError) as error:
                self.problem = str(error)
            except Exception as error:  # a plugin's driver may raise any exception
                self.problem = f"{type(error).__name__}: {error}"
            finally:
                self._driver.close()
            if not self.ending.wait(pause):
                pause = min(2.0 * pause, LONGEST_PAUSE)
