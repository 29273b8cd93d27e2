"""Numbers of a run over the last minutes: everything numeric in its snapshots, by name."""

from __future__ import annotations

from array import array
from collections import deque
from math import degrees, isfinite, nan

import numpy as np

from stack.telemetry.records import Snapshot
from stack.types import FloatArray, Pose2D

KEPT = 600.0
"""Seconds of the robot's clock."""

SPACING = 0.1
"""Smallest distance of two samples, seconds of the robot's clock."""


FASTEST = 5.0
"""Speed of the truth above which the robot was lifted and has not driven, m/s."""


def figures_of(snapshot: Snapshot) -> dict[str, float]:
    """Every number of a snapshot by name, with its unit at the end of the name."""
    pose, command, twist = snapshot.pose, snapshot.commanded, snapshot.measured
    found = {
        "speed set m/s": command.linear, "speed of the wheels m/s": twist.linear,
        "turning set rad/s": command.angular, "turning rad/s": twist.angular,
        "sideways m/s": twist.lateral, "health": snapshot.health,
        "deviation m": float(snapshot.covariance[:2, :2].trace()) ** 0.5,
        "rivals": float(len(snapshot.rivals)), "battery %": snapshot.battery.charge * 100.0,
        "x m": pose.x, "y m": pose.y, "heading °": degrees(pose.heading),
        "limitations": float(len(snapshot.limitations)), "tracks": float(len(snapshot.tracks)),
        "simulation speed ×": snapshot.speed, "memory MB": snapshot.memory / 1e6,
    }  # fmt: skip
    if snapshot.truth is not None:
        found["pose error m"] = pose.distance_to(snapshot.truth)
    found |= {f"{name} ms": stage.median * 1e3 for name, stage in snapshot.stages.items()}
    found |= {f"{sensor.name} Hz": sensor.rate for sensor in snapshot.sensors}
    found |= {f"counter {name}": float(value) for name, value in snapshot.counters.items()}
    for key, text in snapshot.blackboard.items():
        try:
            found[f"key {key}"] = float(text)
        except ValueError:
            continue
    return {name: value for name, value in found.items() if isfinite(value)}


class Figures:
    """The numbers of the last KEPT seconds.

    Attributes:
        names: of all numbers so far, in the order in which they came.
        true_speed: of the truth between the last two samples, m/s; NaN where there is no truth, or
            the robot was lifted.
    """

    def __init__(self) -> None:
        self.names: list[str] = []
        self.true_speed = nan
        self._before: tuple[float, Pose2D] | None = None
        self._index: dict[str, int] = {}
        self._rows: deque[tuple[float, array[float]]] = deque()

    def add(self, snapshot: Snapshot) -> None:
        """Take the numbers of a snapshot, unless it is too close to the last one."""
        time = snapshot.time
        if self._rows and time < self._rows[-1][0] + SPACING:
            return
        self._take_truth(snapshot)
        values = figures_of(snapshot)
        if isfinite(self.true_speed):
            values["true speed m/s"] = self.true_speed
        for name in values:
            if name not in self._index:
                self._index[name] = len(self.names)
                self.names.append(name)
        row = array("f", [values.get(name, nan) for name in self.names])
        self._rows.append((time, row))
        while self._rows[0][0] < time - KEPT:
            self._rows.popleft()

    def restart(self) -> None:
        """Forget all of them."""
        self._rows.clear()
        self._before, self.true_speed = None, nan

    def _take_truth(self, snapshot: Snapshot) -> None:
        before, now = self._before, snapshot.truth
        self._before, self.true_speed = None if now is None else (snapshot.time, now), nan
        if before is not None and now is not None:
            speed = before[1].distance_to(now) / (snapshot.time - before[0])
            self.true_speed = speed if speed <= FASTEST else nan

    def series(self, name: str, span: float) -> tuple[FloatArray, FloatArray]:
        """Times (n,) and values (n,) of a number in the last `span` seconds, without gaps."""
        if not self._rows or name not in self._index:
            return np.empty(0), np.empty(0)
        index, since = self._index[name], self._rows[-1][0] - span
        found = [
            (time, row[index])
            for time, row in self._rows
            if time >= since and index < len(row) and isfinite(row[index])
        ]
        both = np.array(found, dtype=np.float64).reshape(-1, 2)
        return both[:, 0], both[:, 1]
