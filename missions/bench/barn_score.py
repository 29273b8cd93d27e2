"""BARN's metric, as its organisers compute it.

D. Perille, A. Truong, X. Xiao, P. Stone, "Benchmarking Metric Ground Navigation", SSRR 2020; the
score is that of the BARN Challenge (ICRA 2022 to 2025).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import mean, median

GOAL_RADIUS = 1.0
"""Metres from the goal within which the robot's true position counts as there."""

TIME_LIMIT = 100.0
"""Seconds on the clock, after which a run has failed."""

START_DISTANCE = 0.1
"""Metres that the robot has driven when its clock starts."""

SPEED = 2.0
"""m/s: the speed at which the optimal time would drive the optimal path."""

EASIEST, HARDEST = 2.0, 4.0
"""k of the score since 2024, and before."""


def score(success: bool, seconds: float, path_length: float, k: float) -> float:
    """success · OT / clip(AT, k·OT, 8·OT), OT = path length / 2 m/s: at most 1 / k.

    Args:
        success: whether the goal was reached in time without a contact.
        seconds: AT, on the run's clock.
        path_length: metres of the optimal path.
        k: multiple of the optimal time that earns full marks.
    """
    optimal = path_length / SPEED
    return success * optimal / min(max(seconds, k * optimal), 8.0 * optimal)


@dataclass(frozen=True, slots=True)
class Crossing:
    """One run through one world, as it stands in the table.

    Attributes:
        status: success | contact | timeout | gave_up.
        cause: why it failed, in a sentence; empty after a success.
        time: seconds on its clock. path_length: of the optimal path, metres.
        driven: metres. clearance: smallest true distance to anything, metres.
        end: x, y, heading where it ended.
        wall_seconds: compute time.
    """

    world: str
    trial: int
    status: str
    cause: str
    time: float
    path_length: float
    driven: float
    clearance: float
    recoveries: int
    replans: int
    end: tuple[float, float, float]
    wall_seconds: float

    @property
    def success(self) -> bool:
        """Whether it counts."""
        return self.status == "success"

    def score(self, k: float) -> float:
        """The metric for this run."""
        return score(self.success, self.time, self.path_length, k)


def summary(crossings: Sequence[Crossing]) -> list[str]:
    """What came of the runs, in lines: success, scores, times, and each failure."""
    if not crossings:
        return ["no runs yet"]
    good = [item for item in crossings if item.success]
    failed = [item for item in crossings if not item.success]
    kinds = sorted({item.status for item in failed})
    how = ", ".join(f"{sum(item.status == kind for item in failed)} {kind}" for kind in kinds)
    seconds = [item.time for item in good] or [float("nan")]
    speeds = [item.driven / item.time for item in good] or [float("nan")]
    lines = [
        f"{len(crossings)} runs in {len({item.world for item in crossings})} worlds",
        f"success        {len(good) / len(crossings):7.2%}  ({how or 'none failed'})",
        f"score k=2      {mean(item.score(EASIEST) for item in crossings):7.4f}  (at most 0.5)",
        f"score k=4      {mean(item.score(HARDEST) for item in crossings):7.4f}  (at most 0.25)",
        f"time           {mean(seconds):6.1f} s  (median {median(seconds):.1f}, of successes)",
        f"mean speed     {mean(speeds):6.2f} m/s",
        f"least clearance {min(item.clearance for item in good):.3f} m" if good else "",
    ]
    lines += [f"  world {item.world} trial {item.trial}: {item.cause}" for item in failed]
    return [line for line in lines if line]


def per_world(crossings: Sequence[Crossing]) -> list[str]:
    """A line for each world: successes, mean score, mean time."""
    lines = [f"{'world':>12}  success  k=2     k=4     time s"]
    for name in dict.fromkeys(item.world for item in crossings):
        runs = [item for item in crossings if item.world == name]
        lines.append(
            f"{name:>12}  {sum(item.success for item in runs)}/{len(runs):<5}"
            f"  {mean(item.score(EASIEST) for item in runs):.4f}"
            f"  {mean(item.score(HARDEST) for item in runs):.4f}"
            f"  {mean(item.time for item in runs):6.1f}"
        )
    return lines
