"""What the shipped missions have to do together: drive every part, and stop whenever told to."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import mission_files, world_files
from missions.inspection.check import check_files
from missions.language.keys import BLACKBOARD_KEY, EVENT, MISSION, MODIFIERS, RECOVER, REPEAT, RETRY
from missions.language.kinds import NODES
from missions.testing.session import run_files
from stack.components import BUILT_IN, DEFAULTS

NAMES = sorted(file.stem for file in mission_files())


def parts_of(mission: str) -> dict[str, set[str]]:
    """What a mission drives: kind -> names of components."""
    choices = prepare(mission, RunOptions()).choices
    used = {kind: {choices[kind].name} for kind in DEFAULTS}
    used["costmap_layer"] = {layer.use for layer in choices["costmap"].parts}
    used["zone"] = {zone.action for zone in choices["safety"].parts}
    smoother = getattr(choices["planner"].parameters, "smoother", "")
    used["smoother"] = {smoother}
    return used


def keys_of(value: object) -> set[str]:
    """All keys and lone words of a mission file."""
    if isinstance(value, dict):
        return set(value).union(*map(keys_of, value.values()))
    if isinstance(value, list):
        return set().union(*map(keys_of, value))
    return {value} if isinstance(value, str) else set()


@pytest.mark.parametrize("file", [*mission_files(), *world_files()], ids=lambda file: file.stem)
def test_shipped_files_have_no_errors(file: Path) -> None:
    assert not [line for line in check_files([str(file)]) if line.finding.severity == "error"]


def test_every_word_of_the_language_is_used_by_a_mission() -> None:
    words = {*NODES, *MODIFIERS, *MISSION, *EVENT, *RECOVER, *REPEAT, *RETRY, *BLACKBOARD_KEY}
    used = set().union(*(keys_of(yaml.safe_load(file.read_text())) for file in mission_files()))
    assert words <= used


NEED_A_FILE = {"localisation": {"pose_graph"}, "controller": {"onnx_policy"}}
"""Components that no shipped mission can use: tests/missions/execution/test_map_and_use.py saves a
graph, tests/missions/learning/test_onnx_policy.py a network."""


def test_every_component_is_driven_by_a_mission() -> None:
    used: dict[str, set[str]] = {}
    for name in NAMES:
        for kind, names in parts_of(name).items():
            used.setdefault(kind, set()).update(names)
    for kind, known in BUILT_IN.items():
        assert set(known) - used[kind] == NEED_A_FILE.get(kind, set()), kind
    assert used["smoother"] >= {"simple", "savitzky_golay", "constrained"}


def test_the_tests_inside_the_missions_pass() -> None:
    session = run_files([str(file) for file in mission_files()])
    assert session.exit_code == 0, session.text
