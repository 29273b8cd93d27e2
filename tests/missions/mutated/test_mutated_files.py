"""Thousands of mutated files: each gives findings with valid positions, or a valid mission.

A mutated file that passes `check` must compile to exactly the nodes that its plain data describes.
Different data must give a different mission, equal data the same one.
"""

from __future__ import annotations

import random
import shutil
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from missions.execution import resources as execution_resources
from missions.execution.prepare import Diagnosis, diagnose
from missions.execution.resources import (
    MISSIONS,
    catalogue_of,
    load_world,
    mission_files,
    resources,
)
from missions.inspection.check import check_files
from missions.language.codes import CODES
from missions.language.model import Mission
from missions.language.reading.mission import read_mission
from missions.trees.compiler import compile_mission
from stack.documents import Finding, read_text
from tests.missions.mutated import oracle
from tests.missions.mutated.mutations import mutated

HERE = Path(__file__).parent
PARTS = ("trees.yaml", "parameters.yaml")
WHOLE = "with_files.yaml"
FILES = [
    *mission_files(), HERE.parents[1] / "benchmarks/files/barn.yaml",
    HERE.parent / "testing/shelf_patrol.yaml",
    HERE / WHOLE, *(HERE / part for part in PARTS),
]  # fmt: skip
SHARDS, CASES = 4, 500


@dataclass
class Bench:
    """A folder with all files unchanged, and the content of each mission."""

    folder: Path
    texts: dict[str, str]
    known: dict[str, tuple[Any, Any]]

    def mission(self, name: str) -> Path:
        """Return the mission to check when this file is mutated."""
        return self.folder / (WHOLE if name in PARTS else name)

    def holds(self, name: str, mission: Mission) -> tuple[Any, Any]:
        """Return the data of the file and the content of the mission read from it."""
        said = read_text((self.folder / name).read_text("utf-8"), name).plain()
        if "world" in said:  # a place can also be one of the world
            world = load_world(mission.world, mission.source.parent).places
            given = {key: [pose.x, pose.y, pose.heading] for key, pose in world.items()}
            said["places"] = {**given, **(said.get("places") or {})}
        return said, oracle.meaning(mission)


@pytest.fixture(autouse=True, scope="module")
def each_robot_and_world_read_once():
    """None of them changes here, and each mission names one of each: half of the time."""
    with pytest.MonkeyPatch.context() as patch:
        for reader in (execution_resources.read_robot, execution_resources.read_any_world):
            patch.setattr(execution_resources, reader.__name__, cache(reader))
        yield


def read(path: Path) -> Mission:
    return read_mission(path, catalogue_of, resources(), {})


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder = tmp_path_factory.mktemp("damaged") / "missions"
    shutil.copytree(MISSIONS / "worlds", folder.parent / "worlds")
    for part in ("logs", "maps", "my_behaviours", "parameters", "routes", "shared_trees"):
        shutil.copytree(MISSIONS / part, folder / part)
    made = Bench(folder, {}, {})
    for file in FILES:
        shutil.copy(file, folder)
        made.texts[file.name] = file.read_text("utf-8")
    for name in made.texts:
        made.known[name] = made.holds(name, read(made.mission(name)))
    return made


@pytest.fixture(autouse=True)
def diagnoses(monkeypatch):
    """The mission that a check reads is the one that is compiled: it is not read twice."""
    made: list[Diagnosis] = []

    def remembered(*arguments) -> Diagnosis:
        made.append(diagnose(*arguments))
        return made[-1]

    monkeypatch.setattr("missions.inspection.diagnosis.diagnose", remembered)
    return made


def place_exists(finding: Finding) -> bool:
    lines = Path(finding.mark.file).read_text("utf-8", errors="replace").split("\n")
    line, column = finding.mark.line, finding.mark.column
    return 1 <= line <= len(lines) and 1 <= column <= len(lines[line - 1]) + 1


def asked_for(bench: Bench, mission: Path) -> oracle.Outline:
    data = read_text(mission.read_text("utf-8"), mission.name).plain()
    trees = dict(data.get("trees") or {})
    for name in data.get("include") or []:
        shared = (bench.folder / name).read_text("utf-8")
        trees |= read_text(shared, name).plain()["trees"]
    return oracle.outline({**data, "trees": trees})


def try_one(bench: Bench, diagnoses: list[Diagnosis], name: str, text: str) -> None:
    (bench.folder / name).write_bytes(text.encode())
    mission = bench.mission(name)
    diagnoses.clear()
    found = [line.finding for line in check_files([str(mission)])]
    for finding in found:
        assert finding is not None, "every finding has a place"
        assert finding.code in CODES or finding.code.startswith(("E0", "E2", "E3", "E4"))
        assert place_exists(finding), finding
    if any(finding is not None and finding.severity == "error" for finding in found):
        return
    checked = [diagnosis.plan.mission for diagnosis in diagnoses if diagnosis.plan is not None]
    model = checked[0] if checked else read(mission)  # a mutated key may hide what a file is
    (said, held), (said_before, held_before) = bench.holds(name, model), bench.known[name]
    tree = compile_mission(model)
    assert oracle.compiled_outline(tree.rows()) == asked_for(bench, mission)
    if said == said_before:
        assert held == held_before, "layout and comments have no meaning"
    elif oracle.told(said) != oracle.told(said_before):
        assert held != held_before, "no part of the file is ignored"


@pytest.mark.slow
@pytest.mark.parametrize("shard", range(SHARDS))
def test_damaged_files_are_refused_or_run_as_they_say(bench, diagnoses, shard):
    chance = random.Random(shard)
    for number in range(CASES):
        name = chance.choice(FILES).name
        text = mutated(bench.texts[name], chance)
        try:
            try_one(bench, diagnoses, name, text)
        except BaseException as error:
            error.add_note(f"shard {shard}, case {number}, {name}:\n{text}")
            raise
        finally:
            (bench.folder / name).write_text(bench.texts[name], "utf-8")
