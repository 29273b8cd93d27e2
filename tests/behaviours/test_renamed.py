"""Old names in plugins and missions are reported with their new names."""

import importlib

import pytest

from behaviours._plugins.renamed import MODULES, NAMES
from behaviours.catalogue import find_behaviours
from missions.inspection.check import check_files
from stack.parameters import RENAMED, suggestion

MISSION = """\
mission: renamed
format: 1
robot: scout
world: small_room
start: [1, 1, 0]
run:
  sequence:
    - {node}
"""


@pytest.mark.parametrize(
    ("line", "new"),
    [
        ("from stack.components import Terms", "PlanOptions"),
        ("from stack.types import Track", "TrackedObject"),
        ("import stack.kinematics", "stack.drivetrain.kinematics"),
        ("from stack.description import Limits", "stack.drivetrain.description"),
        ("from behaviours.drive_for import DriveFor", "behaviours.motion.drive_for"),
        ("from behaviours import drive_for", "behaviours.motion.drive_for"),
    ],
)
def test_a_plugin_with_an_old_import_is_told_the_new_name(tmp_path, line, new):
    (tmp_path / "beep.py").write_text(f"{line}\n")
    (problem,) = find_behaviours([f"{tmp_path}/"]).problems
    assert "line 1: cannot import: " in str(problem)
    assert f"; it was renamed to {new}" in str(problem)


def test_new_names_exist():
    for new in MODULES.values():
        importlib.import_module(new)
    for (module, old), new in NAMES.items():
        assert hasattr(importlib.import_module(module), new)
        assert not hasattr(importlib.import_module(module), old)


@pytest.mark.parametrize(
    ("node", "sentence"),
    [
        ("check: localisation.quality > 0.5", "was renamed to 'localisation.health'"),
        ("relocalise: {min_quality: 0.4}", "did you mean 'min_health'"),
    ],
)
def test_old_words_of_missions_are_errors_with_the_new_word(tmp_path, node, sentence):
    path = tmp_path / "renamed.yaml"
    path.write_text(MISSION.replace("{node}", node))
    errors = [finding.text for finding in check_files([str(path)]) if finding.is_error]
    assert len(errors) == 1
    assert sentence in errors[0]


def test_old_parameters_are_errors_with_the_new_word():
    assert RENAMED["lost_quality"] == "lost_health"
    assert suggestion("lost_quality", ["lost_health", "lost_time"]) == (
        "'lost_quality' was renamed to 'lost_health'"
    )
    # without the new word among the known ones the usual hint stands
    assert suggestion("lost_quality", ["lost_time"]).startswith(("did you mean", "available"))
