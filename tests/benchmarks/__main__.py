"""`python -m tests.benchmarks [NAME…] [--seeds N] [--jobs J]`: measure, print, keep as JSON."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

from tests.benchmarks import control, costmap, driving, missions, planners, planning, startup, trees
from tests.benchmarks.table import Rows, keep, show


def main() -> None:
    """Run the chosen benchmarks, or all of them."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("names", nargs="*", help="which ones; all without")
    arguments.add_argument("--seeds", type=int, default=10, help="seeds of each mission")
    arguments.add_argument("--kidnaps", type=int, default=60, help="seeds of mission 05")
    arguments.add_argument("--jobs", type=int, default=2, help="processes for the mission table")
    arguments.add_argument("--trials", type=int, default=2, help="of each narrow passage")
    arguments.add_argument("--worlds", type=int, default=5, help="of moving cylinders")
    given = arguments.parse_args()
    benchmarks: dict[str, tuple[str, Callable[[], Rows]]] = {
        "commands": ("Commands", startup.command_times),
        "run": ("02_office_patrol on one core, recording off", startup.run_figures),
        "trees": ("A tick of a tree, ours and py_trees'", trees.run),
        "planning": ("Planning on generated office maps", planning.run),
        "control": ("A command of each controller", control.run),
        "costmap": ("Costmap and tracker, processor time", costmap.run),
        "planners": ("Planners and smoothers side by side", planners.run),
        "missions": (
            "Missions over seeds",
            lambda: missions.mission_table(given.seeds, given.jobs),
        ),
        "courses": (
            "Narrow passages, default parameters",
            lambda: driving.course_table(given.trials, given.jobs),
        ),
        "dyna": (
            "Across a field of moving cylinders",
            lambda: driving.dyna_table(given.worlds, given.jobs),
        ),
        "wall": ("Wall following (04)", lambda: missions.wall_table(3, given.jobs)),
        "kidnap": (
            "Kidnapping (05)",
            lambda: missions.kidnap_table(given.kidnaps, given.jobs),
        ),
    }
    for name in given.names:
        if name not in benchmarks:
            arguments.error(f"no benchmark {name!r}; there are {', '.join(benchmarks)}")
    for name in given.names or benchmarks:
        title, measure = benchmarks[name]
        rows = measure()
        show(title, rows)
        keep(name, rows)


if __name__ == "__main__":
    main()
