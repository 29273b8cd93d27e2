"""Files that are broken, huge or of the wrong kind: one clear finding each, and no import."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS, WORLDS, find_mission, load_map, load_robot
from missions.inspection.check import check_files
from missions.language.analysis.data_flow import MAX_LEVELS, MAX_STEPS
from missions.nav2.reading import read_nav2
from stack.documents import read_text
from stack.errors import InputError
from stack.sim.import_world import read_any_world

HEAD = "mission: a\nrobot: scout\nworld: office\n"
ROBOT = MISSIONS.parent / "robots" / "scout" / "robot.yaml"
NAV2 = MISSIONS / "parameters" / "nav2_params.yaml"
MISSION = MISSIONS / "01_drive_to_a_point.yaml"


def findings(text: str, folder: Path) -> list[str]:
    file = folder / "mission.yaml"
    file.write_text(text)
    return [line.text.splitlines()[0] for line in check_files([str(file)])]


@pytest.mark.parametrize(
    ("text", "where"), [("[" * 100_000, "1:62"), (f"{HEAD}run: {'[' * 100_000}", "4:66")],
    ids=["alone", "in_run"],
)  # fmt: skip
def test_100_kb_of_brackets_are_refused_where_they_are_too_deep(text, where, tmp_path):
    # 61 levels are allowed, `run:` is one of them; the next bracket is column 62, or 6 + 60.
    (found,) = findings(text, tmp_path)
    assert f":{where} error[E004] nested more than 60 deep" in found


def chain(length: int) -> str:
    trees = [f"  t{number}: {{do: {{use: t{number + 1}}}}}\n" for number in range(1, length)]
    return f"{HEAD}run: {{use: t1}}\ntrees:\n{''.join(trees)}  t{length}: {{do: {{say: hi}}}}\n"


def test_nested_trees_are_refused_above_100_levels(tmp_path):
    # A chain of n trees has n `use` nodes and the leaf.
    assert findings(chain(MAX_LEVELS - 1), tmp_path) == []
    for length in (MAX_LEVELS, 250, 2000):
        (found,) = findings(chain(length), tmp_path)
        assert "error[E126] nodes are nested more than 100 levels deep" in found


def test_10_000_nodes_are_allowed(tmp_path):
    def mission(leaves: int) -> str:
        # 1 sequence, 100 uses of a sequence with 98 leaves, and some leaves.
        tree = "trees:\n  t:\n    do:\n      sequence:\n" + "        - {say: hi}\n" * 98
        children = "    - {use: t}\n" * 100 + "    - {say: hi}\n" * leaves
        return f"{HEAD}run:\n  sequence:\n{children}{tree}"

    nodes = 1 + 100 * (1 + 1 + 98)
    assert findings(mission(0).replace("    - {use: t}\n", "    - {say: a}\n", 1), tmp_path) == []
    assert nodes == MAX_STEPS + 1
    (found,) = findings(mission(0), tmp_path)
    assert "the mission has 10001 nodes with all trees expanded; at most 10000" in found


def checked(path):
    return check_files([str(path)])


def planned(path):
    return prepare(path, RunOptions())


@pytest.mark.parametrize(
    ("read", "file", "sentence", "hint"),
    [
        (planned, ROBOT,
         "this is a robot file, not a mission", "name it under `robot:` of a mission"),
        (checked, NAV2, "this is a Nav2 parameter file, not a mission", "nav2_params"),
        (read_any_world, MISSION, "this is a mission, not a world file", "`treepilot run`"),
        (read_any_world, ROBOT, "this is a robot file, not a world file", "`robot:`"),
        (lambda path: load_robot(str(path), Path()), MISSION, "this is a mission, not a robot file",
         "`treepilot run`"),
        (lambda path: load_robot(str(path), Path()), WORLDS / "office.yaml",
         "this is a world file, not a robot file", "name it under `world:` of a mission"),
        (lambda path: load_map(str(path), Path()), WORLDS / "office.yaml",
         "this is a world file, not a map file", "`world:`"),
        (read_nav2, WORLDS / "office.yaml", "this is a world file, not a Nav2 parameter file",
         "`world:`"),
    ],
)  # fmt: skip
def test_a_file_of_another_kind_gives_one_finding(read, file, sentence, hint):
    try:
        (found,) = [line.finding for line in read(file)]
    except InputError as error:
        (found,) = error.findings
    assert (found.code, found.sentence) == ("E007", sentence)
    assert hint in found.hint


def test_a_world_as_mission_is_one_finding_and_a_misspelt_mission_is_still_one(tmp_path):
    text = (WORLDS / "office.yaml").read_text()
    (tmp_path / "office.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        planned(tmp_path / "office.yaml")
    (found,) = caught.value.findings
    assert found.sentence == "this is a world file, not a mission"
    misspelt = findings(HEAD.replace("mission:", "mision:") + "rnu: {say: hi}\n", tmp_path)
    assert any(
        "the mission has no key 'mision'; did you mean 'mission'?" in line for line in misspelt
    )


@pytest.mark.parametrize(
    ("names", "missing", "hint"),
    [
        (["patrol.yaml"], "patrl.yaml", "did you mean"),
        (["inspection.yaml"], "patrl.yaml", "give the path of a mission file"),
        (["here/other.yaml"], "gone/patrol.yaml", "there is no folder"),
    ],
)
def test_only_similar_files_are_suggested(names, missing, hint, tmp_path):
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(HEAD)
    with pytest.raises(InputError) as caught:
        find_mission(tmp_path / missing)
    assert hint in caught.value.findings[0].hint


def test_a_broken_link_is_named_and_not_suggested(tmp_path):
    link = tmp_path / "patrol.yaml"
    link.symlink_to("gone.yaml")
    for read in (find_mission, read_any_world):
        with pytest.raises(InputError) as caught:
            read(link)
        (found,) = caught.value.findings
        assert found.sentence == "this is a broken link: there is no 'gone.yaml'"
        assert "patrol" not in found.hint


LOUD = '''print("imported")
from py_trees.behaviours import Success


class Loud(Success):
    """Prints."""
'''


@pytest.mark.parametrize(
    ("use", "code"),
    [
        ("run: loud_module.Loud", "E121"),
        ("navigation: {planner: {use: 'loud_module:Loud'}}\nrun: {say: hi}", "E111"),
    ],
)
def test_check_imports_only_modules_of_the_plugin_list(use, code, tmp_path, monkeypatch, capsys):
    (tmp_path / "loud_module.py").write_text(LOUD)
    monkeypatch.syspath_prepend(str(tmp_path))
    (found,) = findings(HEAD + use + "\n", tmp_path)
    assert f"error[{code}]" in found
    assert "add its module to the mission: `plugins: [loud_module]`" in found
    assert "loud_module" not in sys.modules
    listed = findings(f"{HEAD}plugins: [loud_module]\n{use}\n", tmp_path)
    assert listed == [] or "does not inherit treepilot.Planner" in listed[0]
    assert "loud_module" in sys.modules
    assert capsys.readouterr() == ("", "imported\n")
    del sys.modules["loud_module"]


def test_a_plugin_that_prints_leaves_the_json_of_check_readable(tmp_path):
    (tmp_path / "loud.py").write_text(LOUD)
    (tmp_path / "a.yaml").write_text(f"{HEAD}plugins: [./loud.py]\nrun: loud\n")
    command = [
        sys.executable,
        "-m",
        "missions.cli.app",
        "check",
        "--json",
        str(tmp_path / "a.yaml"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert "imported" in done.stderr


def test_an_error_far_inside_a_large_file_is_explained_without_parsing_it_again(monkeypatch):
    monkeypatch.setattr("yaml.SafeLoader", None)  # the slow parser, for nearer errors only
    with pytest.raises(InputError, match=r"3:1 error\[E004\]"):
        read_text("a: [" + "b," * 120_000 + "]\nc: d\n]\n", "long.yaml")
