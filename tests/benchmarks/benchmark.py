"""What a benchmark of the documentation is, and what the command line chooses."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from missions.bench.bench import Bench, E, Options, R, Rows
from missions.bench.processes import Alive, ProcessEnded, results
from missions.bench.run_table import RUNS_PER_PROCESS, measured
from tests.benchmarks.layouts import Layout

HELD_OUT = 9000
"""First seed that is not used for development."""

FILES = Path(__file__).with_name("files")
"""Missions of the benches."""


@dataclass(frozen=True)
class MoreOptions(Options):
    """Options of the benches that are not part of the product.

    Attributes:
        mission: replaces the mission of the bench. arguments: of the mission.
        files: worlds or recorded tracks.
        speed: wanted, m/s.
    """

    mission: str = ""
    arguments: Mapping[str, str] = field(default_factory=dict)
    files: tuple[Path, ...] = ()
    speed: float = 0.4


@dataclass(frozen=True)
class Given:
    """Options of the command line.

    Attributes:
        counts: numbers of runs, by name.
        folder: of the runs. A clean commit's runs are kept there and resumed.
        chosen: fields of `MoreOptions` in place of those of the documentation's figures.
        seed: first one in place of that of the documentation's figures.
        repeats: runs of each world, likewise.
    """

    counts: Mapping[str, int]
    jobs: int
    folder: Path
    barn: Path | None = None
    logs: Path | None = None
    chosen: Mapping[str, Any] = field(default_factory=dict)
    seed: int | None = None
    repeats: int | None = None

    def __getitem__(self, count: str) -> int:
        """Return a number of runs."""
        return self.counts[count]

    def seeds(self, first: int, count: int) -> range:
        """Return the seeds from the first on, or from the chosen one on."""
        first = first if self.seed is None else self.seed
        return range(first, first + count)

    def options(self, name: str, seeds: range = range(1), **figures: Any) -> MoreOptions:
        """Return the options of a bench.

        Args:
            name: of the bench and of its folder.
            seeds: of the runs.
            figures: fields of `MoreOptions` for the documentation's figures.
        """
        fields = {"out": self.folder / name, **figures, **self.chosen}
        return MoreOptions(jobs=self.jobs, seeds=seeds, **fields)


def table(bench: Bench[E, R], options: Options) -> Rows:
    """Fill the table of a bench and return its figures."""
    return bench.table(measured(bench, options, tell))


def tell(line: str) -> None:
    """Print a line of progress."""
    print(line, file=sys.stderr)


def in_order(
    function: Callable[[Any], dict[str, Any]], tasks: Sequence[Any], jobs: int
) -> list[Any]:
    """Return the results in the order of the tasks.

    Raises:
        RuntimeError: a process ended without a result.
    """
    if jobs == 1:
        return [function(task) for task in tasks]
    found = dict(results(partial(_only, function), tasks, jobs, RUNS_PER_PROCESS))
    for task, result in found.items():
        if isinstance(result, BaseException):
            raise result
        if isinstance(result, ProcessEnded):
            raise RuntimeError(f"{task}: {result.reason}")
    return [found[task] for task in tasks]


def _only(function: Callable[[Any], dict[str, Any]], _: Alive) -> Callable[[Any], dict[str, Any]]:
    return function


@dataclass(frozen=True)
class Benchmark:
    """One table.

    Attributes:
        options: counts and files of the command line on which its figures depend.
        setting: what else was chosen.
        layout: of the table in the documentation; None: in layouts.py.
    """

    title: str
    measure: Callable[[Given], Rows]
    options: tuple[str, ...] = ()
    setting: Mapping[str, str | int] = field(default_factory=dict)
    layout: Layout | None = None


def benches() -> dict[str, Benchmark]:
    """Return the benches of the package `benches` by name."""
    package = import_module("tests.benchmarks.benches")
    found: dict[str, Benchmark] = {}
    for module in iter_modules(package.__path__):
        found |= import_module(f"{package.__name__}.{module.name}").BENCHMARKS
    return found
