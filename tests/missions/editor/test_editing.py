"""Outline, rename, quick fixes and the pause before a check, over LSP."""

import pytest

from missions.language.keys import MISSION
from tests.benchmarks.editing import edit_series
from tests.benchmarks.large_mission import large_mission
from tests.missions.editor.lsp_client import Client

PATROL = """\
mission: 😀 patrol
robot: scout
world: small_room
include: [common.yaml]
start: shelf
places:
  shelf: [1.0, 1.0, 90 deg]
arguments:
  dwell: {type: duration, default: 3 s}
blackboard:
  count: {type: int, initial: 0}
events:
  - low:
      when: battery.charge < 0.2 and $count > 1
      do: {use: inspect, with: {target: $shelf}}
run:
  sequence:
    - for_each: {stop: [$shelf, $depot, $dock]}
      do: {use: inspect, with: {target: $stop}}
    - set: {count: $count + 1}
      name: count it
    - check: $count == 1 and $shelf.x > 0
    - say: "😀 ${count} of ${$count + 1}, $count, at ${shelf}"
    - wait: $dwell
    - navigate_to_pose: [$shelf.x + 1 m, $shelf.y, 0]
    - wait: ($count + 1) * 2 s
trees:
  inspect:
    in: {target: Pose}
    events: [{near: {when: $count > 2, do: {say: near}}}]
    do: {navigate_to_pose: $target}
tests:
  - name: counts
    at: {1 s: {$count: 3}}
    mock: {inspect: success}
    expect: {count: 4, ran: {inspect: [1, 9]}, order: [inspect]}
"""
COMMON = """\
places:
  depot: [1, 2]
trees:
  fetch:
    do: {sequence: [{navigate_to_pose: $depot}, {use: look}]}
  look:
    do: {wait: 1 s}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "common.yaml").write_text(COMMON)
    (tmp_path / "patrol.yaml").write_text(PATROL)
    return tmp_path


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    client = Client(tmp_path_factory.mktemp("server"))
    yield client
    assert client.close() == 0


@pytest.fixture
def patrol(client, folder):
    shown = client.open(folder / "patrol.yaml", PATROL)
    assert all(line.startswith("W") for line in shown), shown
    return client


def test_the_outline_follows_the_file(patrol):
    shown = {name: (line, below) for name, line, below in patrol.symbols()}
    assert list(shown) == [key.partition(":")[0] for key in PATROL.splitlines()
                           if key[0].isalpha()]  # fmt: skip
    assert set(shown) <= set(MISSION)
    assert shown["places"][1] == [("shelf", 7, [])]
    assert shown["events"][1] == [("low", 13, [("use inspect", 15, [])])]
    [(name, line, children)] = shown["run"][1]
    assert (name, line) == ("sequence", 17)
    assert [(name, line) for name, line, _ in children] == [
        ("for_each", 18), ("count it", 20), ("check", 22), ("say", 23), ("wait", 24),
        ("navigate_to_pose", 25), ("wait", 26),
    ]  # fmt: skip
    assert children[0][2] == [("use inspect", 19, [])]
    assert shown["trees"][1] == [
        (
            "inspect",
            28,
            [
                ("near", 30, [("say", 30, [])]),
                ("navigate_to_pose", 31, []),
            ],
        )
    ]
    assert shown["tests"][1] == [("counts", 33, [])]


def test_a_broken_file_still_has_an_outline(patrol):
    patrol.change(PATROL.replace("wait: $dwell", "wiat: $dwel").replace("robot: scout\n", ""))
    assert [name for name, _, _ in patrol.symbols()][:3] == ["mission", "world", "include"]


def test_a_place_is_renamed_wherever_it_is_used(patrol):
    after = PATROL.replace("shelf", "rack")
    assert patrol.rename("target: $she|lf}", "rack") == {"patrol.yaml": after}
    assert patrol.rename("start: she|lf", "rack") == {"patrol.yaml": after}
    assert patrol.rename("  she|lf: [", "$rack") == {"patrol.yaml": after}


def test_a_key_is_renamed_in_expressions_texts_and_tests(patrol):
    after = (
        PATROL.replace("count: {type", "visits: {type").replace("$count >", "$visits >")
        .replace("set: {count: $count", "set: {visits: $visits")
        .replace("check: $count", "check: $visits").replace("($count", "($visits")
        .replace("${count} of ${$count + 1}, $count,", "${visits} of ${$visits + 1}, $count,")
        .replace("{$count: 3}", "{$visits: 3}").replace("expect: {count", "expect: {visits")
    )  # fmt: skip
    for marked in ("  cou|nt: {type", "{cou|nt: $count +", "check: $cou|nt"):
        assert patrol.rename(marked, "visits") == {"patrol.yaml": after}


def test_a_tree_is_renamed_with_its_uses_and_tests(patrol):
    after = PATROL.replace("inspect", "examine")
    assert patrol.rename("  insp|ect:", "examine") == {"patrol.yaml": after}
    assert patrol.rename("order: [insp|ect", "examine") == {"patrol.yaml": after}


def test_an_included_place_is_renamed_in_both_files(patrol, folder):
    both = {
        "patrol.yaml": PATROL.replace("$depot", "$store"),
        "common.yaml": COMMON.replace("depot", "store"),
    }
    assert patrol.rename("$dep|ot", "store") == both
    patrol.open(folder / "common.yaml", COMMON)
    assert patrol.rename("  dep|ot: [", "store") == both
    assert patrol.rename("use: lo|ok", "glance") == {
        "common.yaml": COMMON.replace("use: look", "use: glance").replace("look:\n", "glance:\n")
    }


def test_unsaved_changes_of_another_file_are_not_overwritten(patrol, folder):
    patrol.open(folder / "common.yaml", "# new\n" + COMMON)
    patrol.open(folder / "patrol.yaml", PATROL)
    answer = patrol.rename("$dep|ot", "store")
    assert answer == "common.yaml has unsaved changes; save it first"
    patrol.tell("textDocument/didClose",
                textDocument={"uri": (folder / "common.yaml").as_uri()})  # fmt: skip


@pytest.mark.parametrize(
    ("marked", "new", "why"),
    [
        ("  she|lf: [", "count", "'count' is already the name of a blackboard key"),
        ("  she|lf: [", "dock", "'dock' is already the name of a place"),
        ("  she|lf: [", "depot", "'depot' is already the name of a place (common.yaml:2)"),
        ("  cou|nt: {type", "stop", "'stop' is already the name of a loop variable"),
        ("  she|lf: [", "target", "'target' is already the name of a `in` of the tree"),
        ("  insp|ect:", "fetch", "there is already a tree 'fetch'"),
        ("  cou|nt: {type", "my count", "'my count' is not a valid name"),
        ("$do|ck]", "base", "'dock' is a place of the world"),
    ],
)
def test_a_rename_that_would_collide_is_refused(patrol, marked, new, why):
    assert why in patrol.rename(marked, new)


@pytest.mark.parametrize("marked", ["robo|t: scout", "wa|it: $", "sequ|ence", "battery.ch|arge"])
def test_words_of_the_language_are_not_renamed(patrol, marked):
    assert patrol.rename(marked, "other") == {}


@pytest.mark.parametrize(
    ("right", "wrong", "marked"),
    [
        ("wait: $dwell", "wiat: $dwell", "wi|at"),
        ("wait: $dwell", "wait: $dwel", "$dw|el"),
        ("start: shelf", "start: shlf", "sh|lf"),
        ("use: inspect, with: {target: $stop}", "use: inspct, with: {target: $stop}", "insp|ct"),
        ("{target: $stop}", "{targt: $stop}", "ta|rgt"),
        ("name: count it", "naem: count it", "na|em"),
        ("$count == 1", "$cont == 1", "$co|nt"),
        ("${$count + 1}", "${$cuont + 1}", "${$cu|ont"),
        ("world: small_room", "wrld: small_room", "wr|ld"),
        ("world: small_room", "world: smal_room", "sm|al_room"),
        ("robot: scout", "robot: scuot", "sc|uot"),
        ("type: duration", "type: durtion", "du|rtion"),
    ],
)
def test_a_suggested_word_replaces_the_wrong_one(patrol, right, wrong, marked):
    assert PATROL.count(right) == 1
    patrol.change(PATROL.replace(right, wrong))
    assert PATROL in patrol.fixes(marked).values()


def test_a_correct_word_has_no_fix(patrol):
    patrol.change(PATROL)
    assert patrol.fixes("wa|it: $dwell") == {}


def test_a_series_of_edits_is_checked_once():
    # `python -m tests.benchmarks commands` measures the processor time: 20 edits cost one check.
    done = edit_series(large_mission(1001), 20)
    assert (done["checks"], done["published"]) == (1, [20])


def test_a_request_during_a_series_of_edits_sees_the_newest_text(folder):
    client = Client(folder, delay=0.2)
    client.open(folder / "patrol.yaml", PATROL)
    client.tell_change(PATROL.replace("wait: $dwell", "wait: $dwel"))
    client.tell_change(PATROL.replace("wait: $dwell", "spin: 90 deg"))
    assert "angle" in client.hover("sp|in: 90 deg")
    assert all(line.startswith("W") for line in client.diagnostics())  # those of the last text
    assert client.close() == 0
