"""Figures of sensors and computer that a snapshot shows but that are not taken for each one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from stack.body import Body, FastLoopBody
from stack.runtime.sensing import Sensing
from stack.runtime.stage_times import Stages
from stack.schedule import Schedule
from stack.telemetry.records import StageTiming
from stack.types import LoopStatistics, SensorState

PERIOD = 1.0
"""Robot time between two figures, s: to take them costs as much as the rest of a snapshot."""

PAGE = 4096
"""Bytes of a page of memory in /proc/self/statm."""


class Figures(NamedTuple):
    """What a snapshot shows of sensors and computer.

    Attributes:
        stages: compute time by stage name.
        sensors: how often each sensor delivers.
        memory: of this process, bytes; 0: unknown.
        fast_loop: timing of the body's fast loop; None without one.
    """

    stages: Mapping[str, StageTiming]
    sensors: tuple[SensorState, ...]
    memory: float
    fast_loop: LoopStatistics | None = None


class SlowFigures:
    """Takes the figures once in a period.

    Args:
        stages: compute times of the loop.
        sensing: sensing stage of the loop.
        body: the robot.
    """

    def __init__(self, stages: Stages, sensing: Sensing, body: Body) -> None:
        self._stages, self._sensing, self._body = stages, sensing, body
        self._due = Schedule(PERIOD)
        self._figures = Figures({}, (), 0.0)

    def at(self, time: float) -> Figures:
        """The figures, taken at most a period before a robot time, s."""
        if self._due.take(time):
            body = self._body
            self._figures = Figures(
                self._stages.timings(), self._sensing.sensors(), resident_memory(),
                body.loop_statistics if isinstance(body, FastLoopBody) else None,
            )  # fmt: skip
        return self._figures


def resident_memory() -> float:
    """Memory of this process, bytes; 0 where the system does not tell."""
    try:
        return float(Path("/proc/self/statm").read_text("ascii").split()[1]) * PAGE
    except OSError:
        return 0.0
