"""How tables of the documentation show the rows of their figures; benches have their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from tests.benchmarks.table import Rows

NONE = "–"
"""Shown where a row has no value."""


@dataclass(frozen=True)
class Layout:
    """Columns of a table.

    Attributes:
        columns: heading -> a format string over the row.
        failed: a format string over the row, which precedes its text under `failed` in the list
            below the table; empty for no such list.
        added: further columns, left out of tables that were measured before there were such
            figures.
    """

    columns: Mapping[str, str]
    failed: str = ""
    added: Mapping[str, str] = field(default_factory=dict)


LAYOUTS: dict[str, Layout] = {
    "slam": Layout({
        "log": "{log}", "translational error": "{error m:.4f} ± {± m:.4f} m",
        "rotational error": "{error °:.2f} ± {± °:.2f}°",
        "contradicted": "{contradicted} of {relations}",
        "error of the others": "{error of the others m:.4f} m", "scans": "{scans}",
        "wall time": "{wall s:.0f} s", "median step": "{step median ms:.1f} ms",
        "99 % of the steps": "{step p99 ms:.1f} ms",
    }),
    "buildings": Layout({
        "seed": "{seed}", "building": "{kind}", "driven": "{driven m} m",
        "odometry off by": "{odometry m:.1f} m", "loops closed": "{closed} of {loops}",
        "false edges": "{false edges}", "median wall error": "{wall error m:.3f} m",
        "90 % of the walls": "{wall p90 m:.3f} m", "median pose error": "{pose error m:.3f} m",
    }),
    "patrol": Layout({
        "hour": "{hour}", "keyframes": "{keyframes}", "edges": "{edges}",
        "memory": "{memory MB} MB", "median error": "{error m:.3f} m", "worst": "{worst m:.3f} m",
        "mean step": "{step mean ms:.1f} ms", "99 % of the steps": "{step p99 ms:.1f} ms",
        "cupboards on the map": "{shown}", "moved, but still there": "{left}",
    }),
    "sessions": Layout({
        "session": "{session}", "keyframes": "{keyframes}", "edges": "{edges}",
        "median error": "{error m:.3f} m", "worst": "{worst m:.3f} m",
        "cupboards on the map": "{shown}", "moved, but still there": "{left}",
    }),
    "explored": Layout({
        "seed": "{seed}", "": "{status}", "reachable area known": "{known %:.1f} %",
        "IoU of the walls": "{IoU:.3f}", "time": "{time s:.0f} s", "driven": "{distance m:.0f} m",
    }),
    "depth": Layout({
        "mission": "{mission}", "depth camera": "{depth camera}", "succeeded": "{success}",
        "without a contact": "{without contact}", "contacts": "{contacts}",
        "median time": "{time s:.1f} s",
    }),
    "depth_stage": Layout({
        "picture": "{picture}", "pictures": "{pictures}", "points kept": "{points}",
        "median": "{median ms:.2f} ms", "99 %": "{p99 ms:.2f} ms",
    }),
    "depth_latency": Layout({
        "a closed door is in": "{in}", "doors": "{doors}",
        "latest after the exposure": "{after exposure s:.2f} s, {frames:.1f} frames",
        "latest after the door": "{after the door s:.2f} s",
    }),
    "cameras": Layout({
        "cameras": "{cameras}", "runs": "{runs}", "load": "{load:.1f}",
        "late, median": "{p50 ms:.2f} ms", "late, 99 %": "{p99 ms:.2f} ms",
        "computed, median": "{computed p50 ms:.2f} ms",
        "computed, 99 %": "{computed p99 ms:.2f} ms",
    }),
    "markers": Layout({
        "distance": "{distance:g} m", "from the normal": "{angle:.0f} deg",
        "detected": "{detected %:.0f} %", "median error": "{error cm:.1f} cm, {error °:.1f}°",
        "95 %": "{error 95 % cm:.1f} cm, {error 95 % °:.1f}°", "mirrored": "{mirrored %:.0f} %",
        "contained": "{contained %:.0f} %",
    }),
    "marker_corridor": Layout({
        "odometry": "{odometry}", "markers": "{markers}", "runs": "{runs}",
        "mean error": "{mean cm:.1f} cm", "95 %": "{95 % cm:.1f} cm",
        "largest": "{largest cm:.0f} cm, {largest °:.1f}°", "contained": "{contained %:.1f} %",
        "mean health": "{health:.2f}", "within 0.3 m": "{right %:.1f} %",
        "pictures used": "{pictures used}",
    }),
    "marker_survey": Layout({
        "map": "{map}", "runs": "{runs}", "surveyed": "{surveyed}",
        "median error": "{median cm:.1f} cm, {median °:.1f}°",
        "largest": "{largest cm:.1f} cm, {largest °:.1f}°",
        "within 2 deviations": "{within 2 deviations %:.0f} %",
    }, added={"mean error of the pose": "{pose cm:.1f} cm", "IoU of the walls": "{IoU}"}),
    "marker_loop": Layout({
        "markers": "{markers}", "runs": "{runs}", "error at the end": "{at the end cm:.0f} cm",
        "largest": "{largest cm:.0f} cm", "error of the keyframes": "{keyframes cm:.0f} cm",
        "IoU of the walls": "{IoU:.2f}",
    }),
    "places": Layout({
        "poses in": "{poses in}", "keyframes": "{keyframes}", "poses": "{poses}",
        "accepted": "{accepted}", "within 0.15 m and 3°": "{right}", "95 %": "{95 %}",
        "pictures": "{pictures:g}",
        "median error": "{error cm:.1f} cm, {error °:.2f}°",
        "largest": "{largest cm:.1f} cm, {largest °:.2f}°",
    }),
    "wall": Layout({
        "side": "{side}", "success": "{success}/{seeds}", "samples": "{samples}",
        "RMS error, worst seed": "{RMS cm (worst seed):.1f} cm",
    }),
    "kidnap": Layout(
        {
            "runs": "{seeds}", "success": "{success}", "noticed within 5 s": "{noticed within 5 s}",
            "corrected within 30 s": "{corrected within 30 s}", "both": "{both}",
            "median until noticed": "{median notice s:.1f} s",
            "median until corrected": "{median correction s:.1f} s", "by a marker": "{by marker}",
        },
        failed="of {seeds}",
    ),
    "twists": Layout(
        {
            "robot": "{robot}", "velocities": "{twists}", "hours": "{hours:.1f}", "km": "{km:.1f}",
            "moving": "{moving %:.0f} %", "drove into": "{drove into}",
            "drove into unseen": "{drove into unseen}",
            "struck moving": "{struck moving}", "struck standing": "{struck standing}",
        },
        failed="{robot}",
    ),
    "speed": Layout({
        "controller": "{controller}", "recording": "{recording}", "success": "{success}",
        "× real time": "{x real time:.1f}", "start to first tick": "{start to first tick s:.1f} s",
        "memory": "{peak memory MB:.0f} MB",
        **{stage: f"{{{stage} ms:.2f}} ms"
           for stage in ("body", "estimate", "costmap", "navigate", "safety", "publish")},
    }),
    "recording": Layout({
        "mission": "{mission}", "success": "{success}",
        "× real time without": "{x real time off:.1f}", "with": "{x real time on:.1f}",
        "cost": "{cost %:.0f} %", "a minute": "{MB a minute:.1f} MB",
        "memory without": "{memory MB off:.0f} MB", "memory with": "{memory MB on:.0f} MB",
    }),
    "hall": Layout({
        "controller": "{controller}", "success": "{success}", "driven": "{distance m:.0f} m",
        "× real time": "{x real time:.1f}", "start to first tick": "{start to first tick s:.1f} s",
        "memory": "{peak memory MB:.0f} MB", "replans": "{replans}",
        "largest pose error": "{error max m:.2f} m", "costmap overruns": "{costmap overruns}",
        **{stage: f"{{{stage} ms:.2f}} ms"
           for stage in ("body", "estimate", "costmap", "navigate")},
    }),
    "watched": Layout({
        "pair": "{pair}", "alone": "{alone s:.2f} s", "watched": "{watched s:.2f} s",
        "cost": "{cost %:.1f} %",
    }),
    "dashboard": Layout({
        "terminal": "{terminal}", "mission": "{state}", "of a core": "{core %:.1f} %",
        "to the terminal": "{kB/s:.1f} kB/s",
    }),
    "commands": Layout({
        "command": "{command}", "median": "{median s:.2f} s", "best": "{best s:.2f} s",
        "processor time": "{processor s:.2f} s",
    }),
    "planning": Layout({
        "": "{what}", "queries": "{queries}", "refused": "{refused}",
        "median": "{median_ms:.2f} ms", "95 %": "{p95_ms:.2f} ms", "worst": "{worst_ms:.1f} ms",
        "median length": "{path_m:.1f} m", "cells expanded": "{expanded}",
        "worst path of cells over the optimum": "{cells_over_optimum_%:.2f} %",
        "median path over the optimum": "{path_over_optimum_%:.1f} %",
    }),
    "planners": Layout({
        "planner": "{planner}", "robot": "{robot}", "found": "{found}",
        "median": "{median_ms:.2f} ms", "worst": "{worst_ms:.1f} ms",
        "length / astar's": "{length_ratio:.3f}", "cost / astar's": "{cost_ratio:.3f}",
    }, added={
        "cost / NavFn's, mean": "{navfn_mean:.3f}", "cost / NavFn's, worst": "{navfn_worst:.3f}",
    }),
    "estop": Layout({
        "situation": "{situation}", "presses": "{presses}", "median": "{median ms:.1f} ms",
        "99 %": "{99 % ms:.1f} ms", "worst": "{worst ms:.1f} ms",
    }),
    "checking": Layout({
        "": "{what}", "nodes": "{nodes}", "processor time": "{processor s:.2f} s",
        "for each further node": "{ms per node:.2f} ms", "peak memory": "{peak memory MB:.0f} MB",
    }),
    "trees": Layout({
        "tree, nodes": "{tree}", "treepilot": "{ours us:.1f} µs",
        "py_trees": "{py_trees us:.1f} µs",
        "treepilot, monitored": "{ours monitored us:.1f} µs",
        "py_trees, monitored": "{py_trees monitored us:.1f} µs",
        "ratio, monitored": "{both monitored:.1f}",
    }),
    "control": Layout({
        "controller": "{controller}", "place": "{place}", "commands": "{commands}",
        "median": "{median ms:.2f} ms", "95 %": "{95 % ms:.2f} ms",
    }),
    "costmap": Layout({
        "": "{what}", "beams": "{beams}", "updates": "{updates}", "median": "{median_ms:.2f} ms",
        "95 %": "{p95_ms:.2f} ms",
    }),
}  # fmt: skip


def _courses(rows: Rows) -> tuple[str, str]:
    return "narrow passages", f"{_total(rows)} passed"


def _missions(rows: Rows) -> tuple[str, str]:
    contacts = sum(row["collisions"] for row in rows)
    return "shipped missions", f"{_total(rows)} succeeded, {contacts} contacts"


def _barn(rows: Rows) -> tuple[str, str]:
    first = rows[0]
    return (
        f"BARN, {first['worlds']} worlds",
        f"{first['success %']:.1f} % success, score {first['score k=2']:.3f} of 0.5",
    )


def _speed(rows: Rows) -> tuple[str, str]:
    factors = [
        f"{row['x real time']:.1f} × real time with recording {row['recording']}"
        for row in rows
        if row["controller"] == rows[0]["controller"]
    ]
    return f"office patrol on one core, {rows[0]['controller']}", ", ".join(factors)


def _total(rows: Rows) -> str:
    """The sum over rows of successes such as 19/20."""
    counts = [map(int, row["success"].split("/")) for row in rows]
    good, runs = (sum(column) for column in zip(*counts, strict=True))
    return f"{good}/{runs}"


SUMMARY: dict[str, Callable[[Rows], tuple[str, str]]] = {
    "courses": _courses, "missions": _missions, "barn": _barn, "speed": _speed,
}  # fmt: skip
"""The lines of the README's table: what was measured, and the result."""
