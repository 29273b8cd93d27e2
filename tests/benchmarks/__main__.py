"""Measure, print and keep as JSON: `python -m tests.benchmarks [NAME…]`.

NAME is a benchmark, or a group of them: `timing` (needs a quiet machine) or `driving` (gives the
same figures on a busy one). All of them without NAME. `--docs` keeps the figures in docs/figures
and writes the tables of the documentation anew; without it they go to bench/. The options of one
bench choose other runs than those of the documentation.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

from missions.cli.arguments import assignments
from missions.cli.bench import named
from tests.benchmarks import (
    cameras,
    checking,
    control,
    costmap,
    dashboard,
    depth,
    estop,
    hall,
    mapping,
    marker_corridor,
    marker_loop,
    marker_survey,
    markers,
    missions,
    places,
    planners,
    planning,
    recording,
    slam,
    startup,
    trees,
    twists,
)
from tests.benchmarks.benchmark import HELD_OUT, Benchmark, Given, benches
from tests.benchmarks.buildings import long_run, scores
from tests.benchmarks.figures import FIGURES, Figures, update_documents, write
from tests.benchmarks.origin import Version, current_version, machine, today
from tests.benchmarks.table import show

BENCH = Path("bench")
CORRIDORS, SURVEYS, LOOPS = 1, 2, 2
"""Runs of the benches of markers: half a minute of processor time each."""

TIMING = {
    "commands": Benchmark("Commands", lambda given: startup.command_times(),
                          setting={"processes": 7}),
    "checking": Benchmark("Check of large missions", lambda given: checking.run(),
                          setting={"processes": checking.RUNS}),
    "speed": Benchmark("02_office_patrol on one core",
                       lambda given: startup.run_figures(given["runs"]),
                       ("runs",), {"recording": "on"}),
    "hall": Benchmark("Across a hall of 200 x 200 m on one core",
                      lambda given: hall.hall_figures(given["runs"]), ("runs",),
                      {"recording": "on", "boxes": hall.BOXES}),
    "recording": Benchmark("Records of a run, processor time",
                           lambda given: recording.recording_figures(given["runs"]), ("runs",),
                           {"recording": "off and on"}),
    "dashboard": Benchmark("The dashboard's process and its terminal",
                           lambda given: dashboard.run(),
                           setting={"mission": dashboard.MISSION, "speed": 1}),
    "watched": Benchmark("What an engine pays for three dashboards",
                         lambda given: dashboard.cost_of_watching(given["pairs"]), ("pairs",),
                         {"mission": dashboard.MISSION, "speed": dashboard.WATCHED_SPEED}),
    "trees": Benchmark("A tick of a tree, ours and py_trees'", lambda given: trees.run(),
                       setting={"rounds": trees.ROUNDS, "ticks in a round": trees.TICKS}),
    "planning": Benchmark("Planning on generated office maps",
                          lambda given: planning.run_up_to(given["largest"]), ("largest",)),
    "control": Benchmark("A command of each controller", lambda given: control.run(),
                         setting={"parameters": "default"}),
    "costmap": Benchmark("Costmap and tracker, processor time", lambda given: costmap.run(),
                         setting={"parameters": "default"}),
    "estop": Benchmark("From the emergency stop's key to the body",
                       lambda given: estop.stop_times(given["presses"]), ("presses",)),
    "planners": Benchmark("Planners and smoothers side by side", lambda given: planners.run(),
                          setting={"cells": "400 x 400", "queries": 30}),
    "cameras": Benchmark(
        "Lateness of commands in real time, cameras off and on",
        lambda given: cameras.run(given["pairs"]), ("pairs",),
        {"mission": cameras.MISSION, "seconds": int(cameras.SECONDS)},
    ),
    "depth_stage": Benchmark("Time of the depth stage", lambda given: depth.stage_table(),
                             setting={"parameters": "default"}),
}  # fmt: skip
OFF: dict[str, str | int] = {"recording": "off"}
DRIVING = {
    **benches(),
    "wall": Benchmark(
        "Wall following (04)", lambda given: missions.wall_table(3, given.jobs),
        setting={**OFF, "seeds": 3},
    ),
    "kidnap": Benchmark(
        "Kidnapping (05)", lambda given: missions.kidnap_table(given["kidnaps"], given.jobs),
        ("kidnaps",), OFF,
    ),
    "twists": Benchmark(
        "Random velocities in furnished rooms",
        lambda given: twists.twist_table(given["twists"], given.options("twists")),
        ("twists",), OFF,
    ),
    "explored": Benchmark(
        "Maps of mission 25 against the world's walls",
        lambda given: mapping.explored_table(given["seeds"]), ("seeds",),
        {**OFF, "parameters": "default"},
    ),
}  # fmt: skip
PERCEPTION = {
    "depth": Benchmark(
        "Missions with and without a depth camera",
        lambda given: depth.contact_table(given["seeds"], given.options("depth")), ("seeds",), OFF,
    ),
    "depth_latency": Benchmark(
        "From the exposure to the obstacle", lambda given: depth.latency_table(),
        setting={"camera": "scout", "doors": depth.CLOSINGS},
    ),
    "markers": Benchmark(
        "The pose from a marker", lambda given: markers.run(),
        setting={"camera": "scout", "pictures": markers.PICTURES},
    ),
    "marker_corridor": Benchmark(
        "Markers in a bare corridor",
        lambda given: marker_corridor.run(HELD_OUT, CORRIDORS, given.folder / "corridor"),
        setting={**OFF, "first seed": HELD_OUT, "seeds": CORRIDORS},
    ),
    "marker_survey": Benchmark(
        "Surveyed markers of the office",
        lambda given: marker_survey.run(HELD_OUT, SURVEYS),
        setting={**OFF, "first seed": HELD_OUT, "seeds": SURVEYS},
    ),
    "marker_loop": Benchmark(
        "A bare loop that a marker closes",
        lambda given: marker_loop.run(HELD_OUT, LOOPS),
        setting={**OFF, "first seed": HELD_OUT, "seeds": LOOPS},
    ),
    "buildings": Benchmark(
        "SLAM in generated buildings",
        lambda given: scores.buildings_table(given.seeds(HELD_OUT, given["buildings"])),
        ("buildings",), {"parameters": "default", "first seed": HELD_OUT},
    ),
    "patrol": Benchmark(
        "A day of SLAM in the same building",
        lambda given: long_run.day_table(given["hours"]), ("hours",), {"parameters": "default"},
    ),
    "sessions": Benchmark(
        "A map that is resumed", lambda given: long_run.sessions_table(),
        setting={"parameters": "default"},
    ),
    "places": Benchmark(
        "Relocalisation by appearance",
        lambda given: places.run(places.POSES, given.folder / "places", given.jobs),
        setting={"robot": "scout", "poses": places.POSES, "first seed": places.HELD_OUT},
    ),
}  # fmt: skip
FILES = ("barn", "logs")
NEEDS = {"barn": "barn", "slam": "logs"}
"""Benchmarks on data that are not part of treepilot, and the option that names their folder."""
RECORDED = {
    "slam": Benchmark(
        "SLAM on recorded logs",
        lambda given: slam.slam_table(given.logs or Path(), BENCH / "slam"),
        ("logs",), {"parameters": "default"},
    ),
}  # fmt: skip
BENCHMARKS = {**TIMING, **DRIVING, **PERCEPTION, **RECORDED}
GROUPS = {"timing": [*TIMING], "driving": [*DRIVING], "perception": [*PERCEPTION]}


COUNTS = {
    "trials": (20, "of each narrow passage"), "worlds": (20, "generated worlds"),
    "seeds": (10, "of each mission"), "kidnaps": (60, "seeds of mission 05"),
    "runs": (2, "seeds of the speed table"),
    "cases": (20, "of each experiment of the localisation"),
    "twists": (100_000, "random velocities over four robots"),
    "presses": (200, "of the emergency stop in each situation"),
    "pairs": (5, "of runs without and with cameras"),
    "largest": (4000, "cells on a side of the largest map to plan on"),
    "buildings": (20, "generated buildings"), "hours": (24, "of SLAM in the same building"),
    "starts": (50, "of each robot that docks"),
}  # fmt: skip
"""Numbers of runs: default and what is counted."""

CHOICES = {
    "robots": "robots, e.g. scout,jackal",
    "controllers": "controllers (barn, dyna)",
    "people": "any of none, social_force, polite, unaware (people)",
}  # fmt: skip
"""Fields of `Options` that are lists of names."""


def main() -> None:
    """Run the chosen benchmarks, or all of them."""
    given, names = parsed()
    version, chosen = current_version(), _chosen(given)
    with _runs_folder(version, given.out) as folder:
        options = Given(
            {name: getattr(given, name) for name in COUNTS}, given.jobs, folder, given.barn,
            given.logs, chosen, given.seed, given.repeats,
        )  # fmt: skip
        for name in names:
            figures = _measured(name, options, version)
            show(BENCHMARKS[name].title, figures.rows)
            if not _is_own(given):
                write(figures, FIGURES if given.docs else BENCH)
    if given.docs:
        update_documents()


def parsed(words: list[str] | None = None) -> tuple[argparse.Namespace, list[str]]:
    """Return the options and the names of the benchmarks; wrong ones end the process."""
    arguments = _arguments()
    given = arguments.parse_args(words)
    chosen = given.names_of_benchmarks
    names = [name for word in chosen or BENCHMARKS for name in GROUPS.get(word, [word])]
    for name in names:
        if name not in BENCHMARKS:
            known = ", ".join([*GROUPS, *BENCHMARKS])
            arguments.error(f"no benchmark {name!r}; expected one of {known}")
    missing = [name for name in names if name in NEEDS and getattr(given, NEEDS[name]) is None]
    for name in missing:
        if name in chosen:
            arguments.error(f"{name} needs --{NEEDS[name]} FOLDER; its data are no part of this")
    if _is_own(given) and (given.docs or len(names) != 1):
        arguments.error("the options of one bench need one NAME, and no --docs")
    return given, [name for name in names if name not in missing]


def _is_own(given: argparse.Namespace) -> bool:
    """Whether other runs are chosen than those of the documentation."""
    return bool(_chosen(given)) or given.seed is not None or given.repeats is not None


def _arguments() -> argparse.ArgumentParser:
    arguments = argparse.ArgumentParser(
        prog="python -m tests.benchmarks", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    arguments.add_argument(
        "names_of_benchmarks", nargs="*", metavar="NAME", help=", ".join(BENCHMARKS)
    )
    arguments.add_argument("--docs", action="store_true", help="keep the figures in docs/figures")
    for name, (default, text) in COUNTS.items():
        arguments.add_argument(f"--{name}", type=int, default=default, help=f"{text} [{default}]")
    arguments.add_argument("--jobs", type=int, default=1, help="processes [1]")
    arguments.add_argument("--barn", type=Path, metavar="WORLDS", help="folder or file of worlds")
    arguments.add_argument("--logs", type=Path, metavar="FOLDER", help="folder of SLAM logs")
    one = arguments.add_argument_group("options of one bench")
    one.add_argument("--out", type=Path, help="folder of the results; the bench resumes there")
    one.add_argument("--seed", type=int, help="first seed")
    one.add_argument("--repeats", type=int, help="runs of each world (barn, dyna)")
    for name, text in CHOICES.items():
        one.add_argument(f"--{name}", metavar="NAMES", help=text)
    for name in ("parameter", "set"):
        one.add_argument(f"--{name}", action="append", metavar="NAME=VALUE", default=[])
    one.add_argument(
        "--names", nargs="+", metavar="NAME", default=[],
        help="only these experiments, worlds, or scenes that begin so",
    )  # fmt: skip
    one.add_argument("--mission", help="another mission (barn, dyna)")
    one.add_argument("--keep", type=Path, help="folder for the records of each run (people)")
    one.add_argument("--tracks", type=Path, action="append", default=[], help="recorded people")
    one.add_argument("--speed", type=float, help="m/s (line)")
    return arguments


def _chosen(given: argparse.Namespace) -> dict[str, Any]:
    """Return the fields of `Options` that the command line gives."""
    fields = {name: named(getattr(given, name) or "") for name in CHOICES} | {
        "parameters": assignments(given.parameter, "--parameter", "safety.top_speed=0.3"),
        "arguments": assignments(given.set), "names": tuple(given.names),
        "mission": given.mission, "keep": given.keep,
        "files": tuple(given.tracks), "speed": given.speed,
    }  # fmt: skip
    return {name: value for name, value in fields.items() if value}


@contextmanager
def _runs_folder(version: Version, out: Path | None) -> Iterator[Path]:
    """Kept by commit, so that an interrupted benchmark continues; never for changed code."""
    if out is not None:
        yield out
        return
    if not version.dirty:
        yield BENCH / f"runs-{version.commit[:10]}"
        return
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)


def _measured(name: str, given: Given, version: Version) -> Figures:
    benchmark, found, date = BENCHMARKS[name], machine(), today()
    rows = benchmark.measure(given)
    values = {option: _shown(option, given) for option in benchmark.options}
    options = "".join(f" --{option} {value}" for option, value in values.items())
    return Figures(
        name=name,
        command=f"python -m tests.benchmarks {name}{options} --docs",
        commit=version.commit,
        dirty=version.dirty or current_version() != version,
        date=date,
        machine=found,
        setting={**benchmark.setting, **values},
        rows=rows,
    )


def _shown(option: str, given: Given) -> str | int:
    """An option's value; never a path of this machine."""
    return {"barn": "WORLDS", "logs": "FOLDER"}[option] if option in FILES else given[option]


if __name__ == "__main__":
    main()
