"""Metric of the BARN Challenge (ICRA 2022 to 2025), as its organisers compute it.

D. Perille, A. Truong, X. Xiao, P. Stone, "Benchmarking Metric Ground Navigation", SSRR 2020.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import mean, median

from missions.bench.runs import Rules, TrialRow

RULES = Rules(goal_radius=1.0, time_limit=100.0)

SPEED = 2.0
"""Speed that defines the optimal time of a path, m/s."""

K_SINCE_2024, K_BEFORE = 2.0, 4.0
"""Factor k of the score since 2024, and before."""


def score(success: bool, seconds: float, path_length: float, k: float) -> float:
    """Return success · OT / clip(AT, k·OT, 8·OT) with OT = path length / 2 m/s; at most 1 / k.

    Args:
        success: whether the goal was reached in time without a contact.
        seconds: actual time AT, on the run's clock.
        path_length: length of the optimal path, metres.
        k: multiple of the optimal time up to which the score is highest.
    """
    if not success:
        return 0.0
    optimal = path_length / SPEED
    return optimal / min(max(seconds, k * optimal), 8.0 * optimal)


def score_of(run: TrialRow, k: float) -> float:
    """Return the score of a run."""
    return score(run.success, run.time, run.path_length, k)


def summary(runs: Sequence[TrialRow]) -> list[str]:
    """Return lines with success rate, scores, times and each failure."""
    if not runs:
        return ["no runs yet"]
    good = [item for item in runs if item.success]
    failed = [item for item in runs if not item.success]
    kinds = sorted({item.status for item in failed})
    by_kind = ", ".join(f"{sum(item.status == kind for item in failed)} {kind}" for kind in kinds)
    seconds = [item.time for item in good] or [float("nan")]
    speeds = [item.driven / item.time for item in good] or [float("nan")]
    lines = [
        f"{len(runs)} runs in {len({item.world for item in runs})} worlds",
        f"success        {len(good) / len(runs):7.2%}  ({by_kind or 'none failed'})",
        f"score k=2      {mean(score_of(item, K_SINCE_2024) for item in runs):7.4f}  (at most 0.5)",
        f"score k=4      {mean(score_of(item, K_BEFORE) for item in runs):7.4f}  (at most 0.25)",
        f"time           {mean(seconds):6.1f} s  (median {median(seconds):.1f}, successful runs)",
        f"mean speed     {mean(speeds):6.2f} m/s",
        f"min clearance  {min(item.clearance for item in good):6.3f} m" if good else "",
    ]
    lines += [f"  world {item.world} trial {item.trial}: {item.cause}" for item in failed]
    return [line for line in lines if line]


def per_world(runs: Sequence[TrialRow]) -> list[str]:
    """Return a line per world: successes, mean scores, mean time."""
    lines = [f"{'world':>12}  success  k=2     k=4     time s"]
    for name in dict.fromkeys(item.world for item in runs):
        own = [item for item in runs if item.world == name]
        lines.append(
            f"{name:>12}  {sum(item.success for item in own)}/{len(own):<5}"
            f"  {mean(score_of(item, K_SINCE_2024) for item in own):.4f}"
            f"  {mean(score_of(item, K_BEFORE) for item in own):.4f}"
            f"  {mean(item.time for item in own):6.1f}"
        )
    return lines
