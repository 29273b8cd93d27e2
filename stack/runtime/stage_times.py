"""Compute time of the loop's stages, for profiling only: no decision depends on it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

from stack.telemetry.records import StageTiming

RECENT = 400
"""Runs of which median and 99th percentile are taken."""


@dataclass(slots=True)
class _Stage:
    budget: float
    total: float = 0.0
    worst: float = 0.0
    count: int = 0
    overruns: int = 0
    recent: deque[float] = field(default_factory=lambda: deque(maxlen=RECENT))

    def add(self, taken: float) -> None:
        self.total += taken
        self.count += 1
        if taken > self.worst:
            self.worst = taken
        self.overruns += taken > self.budget
        self.recent.append(taken)

    def timing(self) -> StageTiming:
        """The figures so far."""
        ordered = sorted(self.recent)
        median, slow = ordered[len(ordered) // 2], ordered[len(ordered) * 99 // 100]
        return StageTiming(
            self.total / self.count, self.worst, self.count, self.overruns, median, slow,
            self.budget,
        )  # fmt: skip


@dataclass
class Stages:
    """Compute time by stage, wall seconds.

    Attributes:
        budget: a run longer than this counts as an overrun, wall seconds.
    """

    budget: float
    stages: dict[str, _Stage] = field(default_factory=dict)
    _timers: dict[str, StageTimer] = field(default_factory=dict)
    _step: float = 0.0

    def begin_step(self) -> None:
        """Begin to add up the stages of a step."""
        self._step = 0.0

    def end_step(self) -> None:
        """Add the sum of the stages since `begin_step` as the stage `step`.

        Six stages of 30 ms are an overrun of a period of 50 ms, although none of them is.
        """
        self.stage("step").add(self._step)

    def measure(self, name: str, asleep: Callable[[], float] | None = None) -> StageTimer:
        """Return a context that adds its run time, without the time that it sleeps, to a stage.

        Args:
            name: of the stage.
            asleep: returns the wall seconds slept so far; None: it does not sleep.
        """
        timer = self._timers.get(name)
        if timer is None:
            timer = self._timers[name] = StageTimer(self, self.stage(name), asleep)
        return timer

    def add(self, stage: _Stage, taken: float) -> None:
        """Add a run of a stage, wall seconds."""
        self._step += taken
        stage.add(taken)

    def stage(self, name: str) -> _Stage:
        """Return the times of a stage."""
        stage = self.stages.get(name)
        if stage is None:
            stage = self.stages[name] = _Stage(self.budget)
        return stage

    def late_share(self, steps: int) -> float:
        """Share of the last steps that took longer than the period."""
        recent = list(self.stage("step").recent)[-steps:]
        return sum(taken > self.budget for taken in recent) / max(len(recent), steps)

    def timings(self) -> dict[str, StageTiming]:
        """Mean, worst, count and overruns of every stage."""
        return {name: stage.timing() for name, stage in self.stages.items() if stage.count}


class StageTimer:
    """Context that measures the runs of a stage, one after the other."""

    __slots__ = ("_asleep", "_began", "_stage", "_stages")

    def __init__(self, stages: Stages, stage: _Stage, asleep: Callable[[], float] | None) -> None:
        self._stages, self._stage, self._asleep = stages, stage, asleep
        self._began = 0.0

    def __enter__(self) -> None:
        asleep = 0.0 if self._asleep is None else self._asleep()
        self._began = perf_counter() - asleep

    def __exit__(self, *_: object) -> None:
        asleep = 0.0 if self._asleep is None else self._asleep()
        self._stages.add(self._stage, perf_counter() - asleep - self._began)
