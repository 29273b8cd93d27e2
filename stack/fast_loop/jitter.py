"""How punctual this machine is: a fast loop with emulated wheels, timed as cyclictest does."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import monotonic, sleep  # noqa: TID251 - a measurement of the machine

from stack.drivetrain.drivetrain import WheelLaw
from stack.drivetrain.limits import Limits
from stack.drivetrain.wheel_loop import WheelGains, plan_of
from stack.fast_loop.client import FastLoop, LoopSetup
from stack.fast_loop.privileges import Privilege
from stack.types import LATENESS_BINS, LoopStatistics, Twist

RATES = (1000.0, 500.0, 250.0, 200.0, 100.0, 50.0)
MISSED = 1e-4
"""Share of deadlines that a loop may miss at a rate that the machine holds."""

COMMANDS_EVERY = 0.05
"""Seconds between the commands, as of a brain at 20 Hz."""

_BURNER = "while True: sum(range(100000))"


@dataclass(frozen=True, slots=True)
class Jitter:
    """One measurement.

    Attributes:
        timing: of the loop.
        lacks: privileges that it did not get although it asked.
        wanted: whether it asked for privileges.
    """

    timing: LoopStatistics
    lacks: tuple[Privilege, ...]
    wanted: bool

    @property
    def holds(self) -> float:
        """Highest of RATES, up to the measured one, at which MISSED is kept, Hz; 0: none."""
        rates = (rate for rate in RATES if rate <= self.timing.rate)
        return next((rate for rate in rates if self.missed(rate) <= MISSED), 0.0)

    @property
    def holds_its_rate(self) -> bool:
        """Whether the measured loop itself kept MISSED."""
        return self.timing.overruns <= MISSED * self.timing.cycles

    def missed(self, rate: float) -> float:
        """Share of cycles that are not done a period after their deadline, at a rate in Hz.

        From the lateness at the measured rate, which does not depend on it, and the mean work. A
        bin counts as missed if any of it is.
        """
        left, timing = 1.0 / rate - self.timing.work, self.timing
        late = sum(
            count for count, end in zip(timing.late, LATENESS_BINS, strict=False)
            if min(end, timing.worst) > left
        )  # fmt: skip
        return late / max(1, sum(timing.late))


def measure(rate: float, seconds: float, *, privileged: bool, load: bool) -> Jitter:
    """Run a loop for some seconds.

    Args:
        rate: cycles per second.
        seconds: of the measurement.
        privileged: whether the loop asks for real-time privileges.
        load: whether as many processes as there are processors compute beside it.
    """
    law = WheelLaw(((1.0, 0.0, -0.2), (1.0, 0.0, 0.2)), 0.1)  # two wheels 0.4 m apart
    plan = plan_of(law, Limits(), 0.3, 2.0, WheelGains())
    setup = LoopSetup(plan, rate=rate, real_time=privileged)
    with _busy_processors(load):
        loop = FastLoop(setup)
        try:
            ends = monotonic() + seconds
            while monotonic() < ends and not loop.has_ended:
                loop.command(Twist(0.3))
                sleep(COMMANDS_EVERY)
            timing = loop.statistics()
        finally:
            loop.close()
    return Jitter(timing, tuple(loop.lacks), privileged)


@contextmanager
def _busy_processors(load: bool) -> Iterator[None]:
    count = (os.cpu_count() or 1) if load else 0
    burners = [subprocess.Popen([sys.executable, "-c", _BURNER]) for _ in range(count)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()


def described(jitter: Jitter, load: bool) -> str:
    """Return lines for people: percentiles, a histogram, the rate that is held, what is lacking."""
    timing = jitter.timing
    rights = "with real-time privileges" if jitter.wanted else "without real-time privileges"
    if jitter.wanted and jitter.lacks:
        rights = f"without the privileges {', '.join(item.name for item in jitter.lacks)}"
    beside = ", all processors busy" if load else ""
    lines = [
        f"{timing.rate:g} Hz {rights}{beside}: {timing.cycles} cycles, {timing.overruns} missed",
        f"  late   median {_time(timing.percentile(0.5))}   99 % {_time(timing.percentile(0.99))}"
        f"   99.9 % {_time(timing.percentile(0.999))}   worst {_time(timing.worst)}",
        f"  work   mean {_time(timing.work)}   worst {_time(timing.worst_work)}",
    ]
    lines += _histogram(timing)
    held = f"holds {jitter.holds:g} Hz" if jitter.holds else f"does not even hold {RATES[-1]:g} Hz"
    missed = 100.0 * jitter.missed(jitter.holds or RATES[-1])
    lines.append(
        f"  {held}: {missed:.3g} % of deadlines missed, at most {100 * MISSED:g} % allowed"
    )
    for item in jitter.lacks:
        lines.append(f"  {item.name}: {item.problem}{f'; {item.remedy}' if item.remedy else ''}")
    return "\n".join(lines)


def _histogram(timing: LoopStatistics) -> list[str]:
    """Return a bar for each octave of lateness; the smallest number of cycles is visible."""
    pairs = [sum(timing.late[i : i + 2]) for i in range(1, len(timing.late), 2)]
    counts = [timing.late[0], *pairs] if timing.late else []
    shown = [number for number, count in enumerate(counts) if count]
    lines = []
    for number in range(shown[0], shown[-1] + 1) if shown else ():
        count, end = counts[number], LATENESS_BINS[min(2 * number, len(LATENESS_BINS) - 1)]
        bar = "█" * max(bool(count), round(40 * count / max(counts)))
        lines.append(f"  {'up to ' + _time(end):>16} {count:8} {bar}".rstrip())
    return lines


def _time(seconds: float) -> str:
    """A time with three digits: 17.3 µs, 1.20 ms."""
    if seconds < 1e-3:
        return f"{seconds * 1e6:.3g} µs"
    return f"{seconds * 1e3:.3g} ms"


def plain(jitter: Jitter, load: bool) -> dict[str, object]:
    """Return JSON-compatible values; seconds and hertz."""
    timing = jitter.timing
    return {
        "rate": timing.rate, "privileged": jitter.wanted, "load": load, "cycles": timing.cycles,
        "missed": timing.overruns, "holds": jitter.holds,
        "late": {
            "median": timing.percentile(0.5), "99": timing.percentile(0.99),
            "99.9": timing.percentile(0.999), "worst": timing.worst,
        },
        "work": {"mean": timing.work, "worst": timing.worst_work},
        "histogram": [
            [end, count] for end, count in zip(LATENESS_BINS, timing.late, strict=False) if count
        ],
        "lacks": [
            {"name": item.name, "problem": item.problem, "remedy": item.remedy}
            for item in jitter.lacks
        ],
    }  # fmt: skip
