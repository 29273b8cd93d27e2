"""A session of `treepilot test`: runs the cases of mission files and prints the results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

from missions.execution.resources import catalogue_of, find_mission, resources
from missions.language.model import Mission, Resources
from missions.language.reading.mission import CatalogueFor, read_mission
from missions.testing.case_run import CaseResult, Place, place_of, run_case
from missions.trees.compiler import compile_mission
from stack.documents import Node

WIDTH = 78


@dataclass(frozen=True)
class Options:
    """Options of a session.

    Attributes:
        keyword: run only cases whose name contains it.
        coverage: list the nodes that no case ticked.
        arguments: values of the missions' arguments, as text; those of a case take precedence.
        catalogue_for: returns the catalogue.
        resources: worlds, robots, maps and components; None for the installed ones.
    """

    keyword: str = ""
    coverage: bool = False
    arguments: Mapping[str, str] = field(default_factory=dict)
    catalogue_for: CatalogueFor = catalogue_of
    resources: Resources | None = None


@dataclass
class FileResult:
    """Results of the cases of one file."""

    mission: Mission
    results: list[CaseResult] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def places(self) -> dict[Place, str]:
        """Every node of the file that can be ticked -> its name."""
        records = compile_mission(self.mission).records
        return {place_of(record): record.names[0] for record in records if record.names}

    @property
    def unreached(self) -> list[tuple[Place, str]]:
        """Nodes that no case ticked, in the order of the file."""
        reached = {place for result in self.results for place in result.reached}
        missed = [(place, name) for place, name in self.places.items() if place not in reached]
        return sorted(missed, key=lambda pair: pair[0][0])


@dataclass(frozen=True)
class Session:
    """Output and exit code of `treepilot test`: 0 all passed, 1 a failure, 2 no case was run."""

    text: str
    exit_code: int


def run_files(names: list[str], options: Options | None = None) -> Session:
    """Run the cases of missions, by file or name.

    Raises:
        InputError: a mission or one of its cases is invalid.
    """
    options = options or Options()
    files = [run_file(find_mission(name), options) for name in names]
    results = [result for file in files for result in file.results]
    failed = sum(not result.passed for result in results)
    code = 2 if not results else 1 if failed else 0
    return Session("\n".join(_lines(files, options)), code)


def run_file(path: Path, options: Options) -> FileResult:
    """Run the cases of one file."""
    found_resources = options.resources or resources()
    given: dict[str, str | Node] = dict(options.arguments)
    found = FileResult(read_mission(path, options.catalogue_for, found_resources, given))
    began = perf_counter()
    for case in found.mission.cases:
        if options.keyword.lower() not in case.name.lower():
            continue
        mission = found.mission
        if case.arguments:
            both = {**given, **case.arguments}
            mission = read_mission(path, options.catalogue_for, found_resources, both)
        found.results.append(run_case(mission, case))
    found.seconds = perf_counter() - began
    return found


def _lines(files: list[FileResult], options: Options) -> Iterator[str]:
    for file in files:
        dots = "".join("." if result.passed else "F" for result in file.results)
        yield f"{file.mission.source} {dots or '(no tests)'}"
    failures = [(file, result) for file in files for result in file.results if not result.passed]
    if failures:
        yield _rule("FAILURES", "=")
    for _, result in failures:
        yield _rule(result.case.name, "_")
        for problem in result.problems:
            yield f"{problem.mark}: {problem.what}"
            yield f"    expected  {problem.expected}"
            yield f"    got       {problem.got}"
        yield f"    the mission: {result.outcome}"
    if options.coverage:
        yield from _coverage(files)
    yield _summary(files, len(failures))


def _coverage(files: list[FileResult]) -> Iterator[str]:
    yield _rule("coverage", "=")
    for file in files:
        total, unreached = len(file.places), file.unreached
        share = 100 * (total - len(unreached)) // total if total else 100
        yield f"{file.mission.source}: {total - len(unreached)} of {total} nodes ticked, {share} %"
        for (mark, _), name in unreached:
            yield f"    {mark} {name} is never ticked"


def _summary(files: list[FileResult], failed: int) -> str:
    passed = sum(len(file.results) for file in files) - failed
    simulated = sum(result.seconds for file in files for result in file.results)
    parts = [f"{failed} failed"] if failed else []
    parts += [f"{passed} passed"] if passed else []
    seconds = sum(file.seconds for file in files)
    words = ", ".join(parts) or "no tests ran"
    return _rule(f"{words} in {seconds:.2f} s ({simulated:.0f} s simulated)", "=")


def _rule(words: str, line: str) -> str:
    return f" {words} ".center(WIDTH, line)
