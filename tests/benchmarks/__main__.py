"""Measure, print and keep as JSON: `python -m tests.benchmarks [NAME…]`.

NAME is a benchmark, or a group of them: `timing` (needs a quiet machine) or `driving` (gives the
same figures on a busy one). All of them without NAME. `--docs` keeps the figures in docs/figures
and writes the tables of the documentation anew; without it they go to bench/.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

from missions.bench.table import TableOptions
from tests.benchmarks import (
    cameras,
    checking,
    control,
    costmap,
    dashboard,
    depth,
    driving,
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
from tests.benchmarks.figures import FIGURES, Figures, update_documents, write
from tests.benchmarks.origin import Version, current_version, machine, today
from tests.benchmarks.table import Rows, show

BENCH = Path("bench")
HELD_OUT, CORRIDORS, SURVEYS, LOOPS = 9000, 1, 2, 2
"""First seed of the benches of markers, and their runs: half a minute of processor time each."""

CONTROLLERS = ("pure_pursuit", "mppi", "dwb")


@dataclass(frozen=True)
class Given:
    """Options of the command line.

    Attributes:
        folder: of the runs. A clean commit's runs are kept there and resumed.
    """

    trials: int
    worlds: int
    seeds: int
    kidnaps: int
    cases: int
    runs: int
    twists: int
    presses: int
    largest: int
    pairs: int
    starts: int
    jobs: int
    barn: Path | None
    logs: Path | None
    folder: Path

    def table(self, name: str) -> TableOptions:
        """Where a benchmark keeps its runs."""
        return TableOptions(self.folder / name, self.jobs)


@dataclass(frozen=True)
class Benchmark:
    """One table.

    Attributes:
        options: of the command line on which its figures depend.
        setting: what else was chosen.
    """

    title: str
    measure: Callable[[Given], Rows]
    options: tuple[str, ...] = ()
    setting: dict[str, str | int] = field(default_factory=dict)


TIMING = {
    "commands": Benchmark("Commands", lambda given: startup.command_times(),
                          setting={"processes": 7}),
    "checking": Benchmark("Check of large missions", lambda given: checking.run(),
                          setting={"processes": checking.RUNS}),
    "speed": Benchmark("02_office_patrol on one core",
                       lambda given: startup.run_figures(given.runs),
                       ("runs",), {"recording": "off and on"}),
    "hall": Benchmark("Across a hall of 200 x 200 m on one core",
                      lambda given: hall.hall_figures(given.runs), ("runs",),
                      {"recording": "off", "boxes": hall.BOXES}),
    "recording": Benchmark("Recording for rerun, processor time",
                           lambda given: recording.recording_figures(given.runs), ("runs",),
                           {"recording": "off and on"}),
    "dashboard": Benchmark("The dashboard's process and its terminal",
                           lambda given: dashboard.run(),
                           setting={"mission": dashboard.MISSION, "speed": 1}),
    "trees": Benchmark("A tick of a tree, ours and py_trees'", lambda given: trees.run(),
                       setting={"rounds": trees.ROUNDS, "ticks in a round": trees.TICKS}),
    "planning": Benchmark("Planning on generated office maps",
                          lambda given: planning.run_up_to(given.largest), ("largest",)),
    "control": Benchmark("A command of each controller", lambda given: control.run(),
                         setting={"parameters": "default"}),
    "costmap": Benchmark("Costmap and tracker, processor time", lambda given: costmap.run(),
                         setting={"parameters": "default"}),
    "estop": Benchmark("From the emergency stop's key to the body",
                       lambda given: estop.stop_times(given.presses), ("presses",)),
    "planners": Benchmark("Planners and smoothers side by side", lambda given: planners.run(),
                          setting={"cells": "400 x 400", "queries": 30}),
    "cameras": Benchmark(
        "Lateness of commands in real time, cameras off and on",
        lambda given: cameras.run(given.pairs), ("pairs",),
        {"mission": cameras.MISSION, "seconds": int(cameras.SECONDS)},
    ),
    "depth_stage": Benchmark("Time of the depth stage", lambda given: depth.stage_table(),
                             setting={"parameters": "default"}),
    "patrol": Benchmark("An hour of SLAM in the same room", lambda given: mapping.patrol_table(),
                        setting={"minutes": 60, "parameters": "default"}),
}  # fmt: skip
OFF: dict[str, str | int] = {"recording": "off"}
DRIVING = {
    "courses": Benchmark(
        "Narrow passages, default parameters",
        lambda given: driving.course_table(given.trials, given.table("courses")),
        ("trials",), OFF,
    ),
    "missions": Benchmark(
        "Missions over seeds",
        lambda given: missions.mission_table(given.seeds, given.table("missions")),
        ("seeds",), OFF,
    ),
    "dyna": Benchmark(
        "Across a field of moving cylinders",
        lambda given: driving.dyna_table(given.worlds, CONTROLLERS, given.table("dyna")),
        ("worlds",), {**OFF, "trials": driving.DYNA_TRIALS},
    ),
    "flats": Benchmark(
        "Random flats with people",
        lambda given: driving.flat_table(given.worlds, given.table("flats")), ("worlds",),
        {**OFF, "first seed": driving.FLATS_HELD_OUT},
    ),
    "people": Benchmark(
        "Meetings with people",
        lambda given: driving.people_table(given.seeds, given.table("people")), ("seeds",),
        {**OFF, "first seed": driving.FLATS_HELD_OUT},
    ),
    "line": Benchmark(
        "Random lines on the floor, 0.4 m/s",
        lambda given: driving.line_table(given.worlds, given.table("line")), ("worlds",),
        {**OFF, "first seed": driving.LINES_HELD_OUT},
    ),
    "docking": Benchmark(
        "Docking from random starts",
        lambda given: driving.docking_table(given.starts, given.table("docking")), ("starts",),
        {**OFF, "first seed": driving.LINES_HELD_OUT},
    ),
    "follow": Benchmark(
        "Following a guide (35)",
        lambda given: driving.follow_table(given.seeds, given.table("follow")), ("seeds",),
        {**OFF, "first seed": driving.LINES_HELD_OUT},
    ),
    "barn": Benchmark(
        "BARN", lambda given: driving.barn_table(given.barn or Path(), given.table("barn")),
        ("barn",), {**OFF, "trials": 1},
    ),
    "localisation": Benchmark(
        "Localisation in generated worlds",
        lambda given: missions.localisation_table(given.cases, given.table("localisation")),
        ("cases",), OFF,
    ),
    "wall": Benchmark(
        "Wall following (04)", lambda given: missions.wall_table(3, given.jobs),
        setting={**OFF, "seeds": 3},
    ),
    "kidnap": Benchmark(
        "Kidnapping (05)", lambda given: missions.kidnap_table(given.kidnaps, given.jobs),
        ("kidnaps",), OFF,
    ),
    "twists": Benchmark(
        "Random velocities in furnished rooms",
        lambda given: twists.twist_table(given.twists, given.table("twists")),
        ("twists",), OFF,
    ),
    "explored": Benchmark(
        "Maps of mission 25 against the world's walls",
        lambda given: mapping.explored_table(given.seeds), ("seeds",),
        {**OFF, "parameters": "default"},
    ),
}  # fmt: skip
PERCEPTION = {
    "depth": Benchmark(
        "Missions with and without a depth camera",
        lambda given: depth.contact_table(given.seeds, given.table("depth")), ("seeds",), OFF,
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
    "places": Benchmark(
        "Relocalisation by appearance",
        lambda given: places.run(places.POSES, given.table("places").out, given.jobs),
        setting={"robot": "scout", "poses": places.POSES, "first seed": places.HELD_OUT},
    ),
}  # fmt: skip
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


def main() -> None:
    """Run the chosen benchmarks, or all of them."""
    arguments = _arguments()
    given = vars(arguments.parse_args())
    words, docs = given.pop("names"), given.pop("docs")
    names = [name for word in words or BENCHMARKS for name in GROUPS.get(word, [word])]
    for name in names:
        if name not in BENCHMARKS:
            known = ", ".join([*GROUPS, *BENCHMARKS])
            arguments.error(f"no benchmark {name!r}; expected one of {known}")
    for name, option in NEEDS.items():
        if name in words and given[option] is None:
            arguments.error(f"{name} needs --{option} FOLDER; its data are not part of treepilot")
    version = current_version()
    with _runs_folder(version) as folder:
        options = Given(**given, folder=folder)
        for name in names:
            if name not in NEEDS or given[NEEDS[name]] is not None:
                figures = _measured(name, options, version)
                show(BENCHMARKS[name].title, figures.rows)
                write(figures, FIGURES if docs else BENCH)
    if docs:
        update_documents()


def _arguments() -> argparse.ArgumentParser:
    arguments = argparse.ArgumentParser(
        prog="python -m tests.benchmarks", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    arguments.add_argument("names", nargs="*", metavar="NAME", help=", ".join(BENCHMARKS))
    arguments.add_argument("--docs", action="store_true", help="keep the figures in docs/figures")
    whole = {
        "trials": (20, "of each narrow passage"), "worlds": (20, "generated worlds"),
        "seeds": (10, "of each mission"), "kidnaps": (60, "seeds of mission 05"),
        "runs": (2, "seeds of the speed table"),
        "cases": (20, "of each experiment of the localisation"),
        "twists": (100_000, "random velocities over four robots"),
        "presses": (200, "of the emergency stop in each situation"),
        "pairs": (5, "of runs without and with cameras"),
        "largest": (4000, "cells on a side of the largest map to plan on"),
        "starts": (50, "of each robot that docks"),
        "jobs": (1, "processes of the driving tables"),
    }  # fmt: skip
    for name, (default, text) in whole.items():
        arguments.add_argument(f"--{name}", type=int, default=default, help=f"{text} [{default}]")
    arguments.add_argument("--barn", type=Path, metavar="WORLDS", help="folder or file of worlds")
    arguments.add_argument("--logs", type=Path, metavar="FOLDER", help="folder of SLAM logs")
    return arguments


@contextmanager
def _runs_folder(version: Version) -> Iterator[Path]:
    """Kept by commit, so that an interrupted benchmark continues; never for changed code."""
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
        setting=benchmark.setting | values,
        rows=rows,
    )


def _shown(option: str, given: Given) -> str | int:
    """An option's value; never a path of this machine."""
    value = getattr(given, option)
    return {"barn": "WORLDS", "logs": "FOLDER"}[option] if isinstance(value, Path) else value


if __name__ == "__main__":
    main()
