"""`check`, the language server, `show` and `run` give the same findings in the same order."""

import random
import shutil
from pathlib import Path

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS, mission_files
from missions.inspection.check import check_files, drawing, with_source_line
from missions.inspection.diagnosis import FileKind, file_kind, findings_of
from missions.language.reading.words import Draft
from stack.documents import Finding, Mark
from stack.errors import InputError
from tests.missions.editor.lsp_client import Client
from tests.missions.mutated.mutations import mutated

TESTS = Path(__file__).parents[1]
FILES = [*mission_files(), *sorted(TESTS.rglob("*.yaml"))]
MUTATIONS = 4

PLUGIN = """from behaviours.base import RobotBehaviour, port


class Grip(RobotBehaviour):
    force: float = port("force", unit="N")

    def __init__(self, name, **ports):
        super().__init__(name, **ports)
        if ports["force"] > 10.0:
            raise RuntimeError("no gripper has so much force")

    def update(self):
        return self.fail("NO", "no")
"""
HEAD = "mission: m\nrobot: scout\nworld: small_room\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("missions")
    shutil.copytree(MISSIONS / "worlds", root / "worlds")
    for part in ("my_behaviours", "parameters", "routes"):
        shutil.copytree(MISSIONS / part, root / "missions" / part)
    (root / "missions" / "grip.py").write_text(PLUGIN)
    for file in FILES:
        shutil.copy(file, root / "missions")
    return root / "missions"


@pytest.fixture(scope="module")
def client(folder):
    client = Client(folder)
    yield client
    assert client.close() == 0


def prepared(path):
    """What `run` says before it starts: its errors, or else its warnings."""
    try:
        plan = prepare(path, RunOptions())
    except InputError as error:
        return list(error.findings)
    return [*plan.mission.warnings, *plan.world.warnings, *plan.warnings]


def checked(path):
    return [line.finding for line in check_files([str(path)])]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_all_agree_on_a_file_and_its_mutations(folder, file):
    path, text = folder / file.name, file.read_text("utf-8")
    chance = random.Random(file.name)
    texts = [text, *(mutated(text, chance) for _ in range(MUTATIONS))]
    try:
        for each in texts:
            path.write_text(each, "utf-8")
            kind = file_kind(path, each)
            found = list(findings_of(path, Draft(each)))
            assert checked(path) == found, each
            if kind in (FileKind.MISSION, FileKind.OTHER):
                assert prepared(path) == found, each
    finally:
        path.write_text(text, "utf-8")


@pytest.mark.parametrize(
    ("rest", "codes"),
    [
        ("start: [2.0, 0.0]\nrun: {wait: 1 s}\n", ["E412"]),
        ("plugins: [./grip.py]\nrun: {grip: {force: 12 N}}\n", ["E127"]),
        (
            "plugins: [./grip.py]\n"
            "run: {sequence: [{grip: {force: 12 N}}, {grip: {force: 9 N}}, {grip: {force: 11}}]}\n",
            ["E127", "E127"],
        ),
        (
            "start: [2.0, 0.0]\ninitial_pose: unknown\nlocalisation: dead_reckoning\n"
            "plugins: [./grip.py]\nrun: {grip: {force: 12 N}}\n",
            ["E412", "E111", "E127"],
        ),
        ("plugins: [./grip.py]\ntrees: {a: {do: {grip: {force: 12 N}}}}\n"
         "run: {sequence: [{use: a}, {use: a}]}\n", ["E127"]),
        ("run: {fallback: [{say: a}, {say: b}]}\n", ["E160"]),
        # Goals are checked in what could be read of a mission with other errors.
        ("run: {sequence: [{navigate_to_pose: [620, 150]}, {navigate_to_poze: [1, 1]}, "
         "{wait: 3 m}]}\n", ["E121", "E132", "E180"]),
        ("run: {sequence: [{navigate_to_pose: [3.4, 1.2]}, {wait: 3 m}]}\n", ["E132", "E181"]),
        ("map: none\nrun: {sequence: [{navigate_to_pose: [620, 150]}, {wait: 3 m}]}\n", ["E132"]),
        ("run: {sequence: [{navigate_to_pose: [6.4, 3]}, {wait: 3 m}]}\n", ["E132"]),
        ("places: {spare: [0, 0]}\nblackboard: {n: {type: int}}\nrun: {wait: 1 s}\n", ["W102"]),
    ],
)  # fmt: skip
def test_what_only_a_run_found_is_found_by_all(folder, client, rest, codes):
    path = folder / "starts.yaml"
    path.write_text(HEAD + rest)
    assert [finding.code for finding in checked(path)] == codes
    assert prepared(path) == checked(path) == list(findings_of(path, Draft(HEAD + rest)))
    shown = client.open(path, HEAD + rest)
    assert [line.split()[0] for line in shown] == codes
    if codes[0].startswith("E"):
        with pytest.raises(InputError) as error:
            drawing(str(path), "text", colours=False)
        assert list(error.value.findings) == checked(path)


TREES = """trees:
  look:
    in: {target: Pose}
    do: {sequence: [{navigate_to_pose: $targt}, {wave: {times: 2}}, {wiat: 1 s}]}
"""


def test_a_file_of_trees_is_checked_as_if_it_were_included(folder, client):
    path = folder / "common_trees.yaml"
    path.write_text(TREES)
    found = checked(path)
    # `wave` may be a behaviour of the mission's plugins; `wiat` resembles `wait`
    codes = ["E140", "W115", "E121"]
    assert [(item.code, item.mark.line) for item in found] == [(code, 4) for code in codes]
    assert sorted(line.split()[0] for line in client.open(path, TREES)) == sorted(codes)


def test_the_map_of_an_argument_is_beside_a_mission_that_is_named_from_elsewhere(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    file = Path("sub") / "mission.yaml"
    argument = "arguments: {flat: {type: path, default: maps/flat}}\nmap: $flat\n"
    file.write_text(f"mission: a\nworld: office\nrobot: scout\n{argument}run: {{wait: 1 s}}\n")
    [finding] = findings_of(file)
    assert finding.sentence.startswith("sub/maps/flat: ")


def test_a_finding_is_shown_with_its_line_and_a_caret():
    finding = Finding(Mark("a.yaml", 2, 8), "E140", "there is no $dok", "did you mean '$dock'?")
    assert with_source_line(finding, ["run:", "  wait: $dok"]) == (
        "a.yaml:2:8 error[E140] there is no $dok; did you mean '$dock'?\n"
        "    2 |   wait: $dok\n"
        "      |        ^"
    )
    assert with_source_line(finding, []) == str(finding)


def test_a_misspelt_key_leaves_a_file_of_faults_one(tmp_path):
    file = tmp_path / "push.yaml"
    file.write_text("dcc: pushed\nfaults:\n  - push\n")
    (item,) = findings_of(file)
    assert "a file of faults has no key 'dcc'" in item.sentence
