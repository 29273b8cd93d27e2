"""`treepilot lsp`, spoken to over a pipe as an editor does."""

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.editor.completion import candidates
from missions.editor.document import read_at_cursor, read_words
from missions.editor.hover import definition, explanation
from missions.editor.serving import serve
from missions.editor.symbols import outline
from missions.execution.resources import mission_files
from missions.inspection.diagnosis import findings_of
from missions.language.codes import CODES
from missions.language.reading.words import Draft
from stack.errors import InputError
from tests.missions.editor.lsp_client import ROOT, Client

MISSION = """\
mission: café 😀 patrol
robot: scout
world: small_room
start: dock
plugins: [./mine]
places:
  shelf: [1.0, 1.0, 90 deg]
navigation:
  planner: {use: astar, allow_unknown: true}
arguments:
  dwell: {type: duration, default: 3 s}
  stops: {type: list of Pose, default: [$shelf, $dock]}
blackboard:
  photo: {type: path, optional: true}
  visited: {type: int, initial: 0, doc: stops}
run:
  sequence:
    - for_each: {stop: $stops}
      do: {use: inspect, with: {target: $stop}, out: {picture: $photo}}
    - wave: {times: 2}
    - set: {visited: $visited + 1}
      when: battery.charge > 0.3 and $photo is set
    - wall_follow: {side: left}
      timeout: 90 s
trees:
  inspect:
    doc: Drive there and look.
    in: {target: Pose}
    out: {picture: path}
    do:
      sequence:
        - navigate_to_pose: {goal: $target, tolerance: 30 cm}
        - wait: $dwell
        - take_photo: {}
          out: {image: $picture}
"""

YAML = {f"E{number:03d}" for number in range(1, 20)}

PLUGIN = '''from py_trees.common import Status

from behaviours.base import RobotBehaviour, port

print("a plugin that talks on import")


class Wave(RobotBehaviour):
    """Wave to people nearby."""

    times: int = port("how often", default=3, at_least=1)

    def update(self) -> Status:
        return Status.SUCCESS
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("missions")
    (folder / "mine").mkdir()
    (folder / "mine" / "wave.py").write_text(PLUGIN)
    (folder / "patrol.yaml").write_text(MISSION)
    return folder


@pytest.fixture(scope="module")
def client(folder):
    client = Client(folder)
    yield client
    assert client.close() == 0


@pytest.fixture
def opened(client, folder):
    """The server with the faultless mission open."""
    assert client.open(folder / "patrol.yaml", MISSION) == []
    return client


def test_it_says_what_it_can(client):
    can = client.capabilities
    assert can["hoverProvider"] and can["definitionProvider"]
    assert "$" in can["completionProvider"]["triggerCharacters"]


@pytest.mark.parametrize("file", mission_files()[:2], ids=lambda file: file.stem)
def test_a_shipped_mission_has_no_findings(client, file):
    assert client.open(file, file.read_text("utf-8")) == []


def test_findings_follow_what_is_typed_before_it_is_saved(opened):
    [line] = opened.change(MISSION.replace("navigate_to_pose: {", "navigate_to_pos: {"))
    assert line.startswith("E121 31:10-25 1 there is no behaviour 'navigate_to_pos'")
    assert "did you mean 'navigate_to_pose'?" in line
    assert opened.change(MISSION) == []


def test_all_findings_come_at_once_with_warnings_told_apart(opened):
    two = opened.change(MISSION.replace("side: left", "side: lefft").replace("90 s", "90 m"))
    assert [line.split()[:3] for line in two] == [
        ["E132", "22:26-31", "1"], ["E132", "23:15-19", "1"],
    ]  # fmt: skip
    [warning] = opened.change(MISSION.replace("visited: {", "spare: {type: int}\n  visited: {"))
    assert warning.startswith("W102 14:2-7 2 ")
    assert {line.split()[0] for line in (*two, warning)} <= CODES.keys()


def test_a_column_behind_an_emoji_counts_as_the_editor_counts(opened):
    [line] = opened.change(MISSION.replace("café 😀 patrol", "café").replace(
        "scout\n", "scout\ndoc: {a: '😀😀', a: 2}\n"))  # fmt: skip
    # the second `a` is character 15 of its line; each of the two emojis before it is two units
    assert line.startswith("E011 2:17-18 1 duplicate key 'a'")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "run: [",
        "\t",
        "run:\n  - {",
        "mission: a\n...\n---\n",
        "a: &x [*x]",
        "!!python/name:os.a",
    ],
)
def test_any_text_gets_an_answer(opened, text):
    assert all(line.split()[0].startswith("E") for line in opened.change(text))
    opened.hover("|" + text[:1])
    opened.complete(text + "|")
    assert opened.change(MISSION) == []


def test_a_fault_in_the_world_shows_where_the_mission_names_it(opened, folder):
    (folder / "cellar.yaml").write_text("world: cellar\nwals: []\n")
    first, *_ = opened.change(MISSION.replace("small_room", "./cellar.yaml"))
    assert first.split(" ", 3)[1] == "2:9-20"
    assert "cellar.yaml:2:1" in first and "'wals'" in first


def test_other_yaml_files_are_left_alone(client, folder):
    assert client.open(folder / "compose.yaml", "services:\n  web: {image: nginx}\n") == []
    assert client.open(folder / "workflow.yaml", "jobs: [\nrun: make\n") == []


def test_a_world_file_has_its_own_findings(client, folder):
    lines = client.open(folder / "hall.yaml", "world: hall\nformat: 1\nwals: []\n")
    assert any(line.startswith("E201 2:0-4 1 a world file has no key 'wals'") for line in lines)
    assert (
        client.open(folder / "hall.yaml", "world: h\nwalls: [{points: [[2, 0], [2, 1]]}]\n") == []
    )


@pytest.mark.parametrize(
    ("marked", "words"),
    [
        ("navigate_to|_pose: {", ["Drive to a pose", "`goal`", "required", "`path_length`"]),
        ("tole|rance", ["Goal tolerance", "number in m", "> 0"]),
        ("wav|e:", ["Wave to people nearby", "`times` (whole number, >= 1)"]),
        ("ti|mes: 2", ["How often", "default `3`"]),
        ("seq|uence:\n    - for", ["children in order until one fails"]),
        ("for|_each", ["`do` once per item"]),
        ("time|out", ["time limit per attempt"]),
        ("$du".replace("du", "dw") + "|ell", ["argument", "duration", "3 s"]),
        ("{goal: $tar|get", ["`in` of the tree inspect", "Pose"]),
        ("target: $st|op}", ["loop variable", "Pose"]),
        ("$do|ck", ["place of the world", "Pose", "[0.60, 2.50, 180 deg]"]),
        ("start: do|ck", ["place of the world"]),
        ("{picture: $ph|oto", ["blackboard key", "text"]),
        ("battery.ch|arge", ["state of charge"]),
        ("vis|ited: $visited", ["blackboard key", "whole number"]),
        ("use: ins|pect", ["Drive there and look.", "`target` (Pose)", "`picture` (text)"]),
        ("im|age: $p", ["**image**"]),
        ("plugi|ns", ["your own behaviours and components of navigation"]),
        ("use: as|tar", ["A* on an 8-connected grid"]),
        ("allow|_unknown", ["plan through unknown cells".capitalize()]),
        ("type: dur|ation", ["duration"]),
        ("robot: sco|ut", ["radius"]),
    ],
)
def test_hover(opened, marked, words):
    text = opened.hover(marked)
    assert all(word in text for word in words), text


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("wait: ma|x($dwell, 2 s)", ["max(a, b, …)", "greatest"]),
        ("wait: battery.cha|rge * 2 s", ["state of charge"]),
        ("wait: $dwe|ll * 2", ["argument", "duration"]),
        ("wa|it: $dwell * 2", ["`time`"]),
        ('say: "${dwe|ll} left"', ["argument", "duration"]),
        ('say: "${$target.hea|ding}"', ["heading of $target", "number in rad"]),
        ("check: dist|ance($target, pose) > 1 m", ["straight-line distance between two poses"]),
    ],
)
def test_hover_in_expressions(opened, line, words):
    opened.change(MISSION.replace("wait: $dwell", line.replace("|", "")))
    text = opened.hover(line)
    assert all(word in text for word in words), text
    assert opened.definition("$target.he|ading" if ".hea" in line else "$do|ck") is not None


def test_hover_goes_on_while_the_file_is_broken(opened):
    opened.hover("tole|rance")
    opened.change(MISSION + "  broken: [\n")
    assert "Goal tolerance" in opened.hover("tole|rance")


@pytest.mark.parametrize(
    ("marked", "place"),
    [
        ("use: ins|pect", ("patrol.yaml", 26)),
        ("$she|lf", ("patrol.yaml", 7)),
        ("$do|ck", ("small_room.yaml", 8)),
        ("start: do|ck", ("small_room.yaml", 8)),
        ("$dwe|ll", ("patrol.yaml", 11)),
        ("{goal: $tar|get", ("patrol.yaml", 28)),
        ("target: $st|op}", ("patrol.yaml", 18)),
        ("{vis|ited: $visited +", ("patrol.yaml", 15)),
        ("and $ph|oto is", ("patrol.yaml", 14)),
        ("world: small|_room", ("small_room.yaml", 1)),
        ("robot: sc|out", ("robot.yaml", 1)),
        ("wa|ve: {", ("wave.py", 8)),
        ("sequ|ence:\n    - for", None),
    ],
)
def test_go_to_definition(opened, marked, place):
    assert opened.definition(marked) == place


INCLUDING = """\
mission: m
robot: scout
world: small_room
include: [common.yaml]
events:
  - low: {when: battery.charge < 0.2, hold: 2 s, do: {use: to_the, with: {goal: $shop}}}
run: {wait: 1 s, every: 3 s, repeat: forever}
tests:
  - name: nothing happens
    expect: {status: success}
"""
COMMON = """\
places:
  shop: [3, 4]
trees:
  to_the:
    in: {goal: Pose}
    do: {navigate_to_pose: $goal}
"""


def test_included_trees_and_places_events_and_cases(client, folder):
    (folder / "common.yaml").write_text(COMMON)
    assert client.open(folder / "including.yaml", INCLUDING) == []
    assert client.definition("use: to_|the") == ("common.yaml", 4)
    assert client.definition("$sh|op") == ("common.yaml", 2)
    assert client.definition("[com|mon.yaml") == ("common.yaml", 1)
    assert "how long the condition must be true" in client.hover("ho|ld: 2 s")
    assert "run at most once" in client.hover("ev|ery")
    assert "expected results" in client.hover("exp|ect")
    assert {"goal", "to_the"}.isdisjoint(client.complete("status: |success"))
    assert "failure" in client.complete("status: |success")
    assert client.open(folder / "common.yaml", COMMON) == []
    assert client.definition("$go|al") == ("common.yaml", 5)


@pytest.mark.parametrize(
    ("old", "marked", "wanted", "unwanted"),
    [
        # kinds of nodes, ports and modifiers
        ("- wave: {times: 2}", "- wa|", {"wave": "wave: {}", "wait": "wait: ",
                                         "sequence": "sequence: "}, ["timeout", "mission"]),
        ("wave: {times: 2}", "wave: {|}", {"times": "times: "}, ["wave", "timeout"]),
        ("tolerance: 30 cm}", "to|}", {"tolerance": "tolerance: "}, ["$dock"]),
        ("timeout: 90 s", "ti|", {"timeout": "timeout: ", "retry": "retry: "}, ["do", "wave"]),
        ("out: {image: $picture}", "|", {"out": "out: "}, ["with", "do"]),
        ("- wall_follow: {side: left}", "- wall_follow:\n        s|", {"side": "side: "}, ["wave"]),
        ("side: left", "side: |", {"left": "left", "right": "right"}, []),
        ("- wait: $dwell", "- switch: {|}", {"cases": "cases: ", "value": "value: "}, ["wait"]),
        ("timeout: 90 s", "repeat: {|}", {"until": "until: "}, ["attempts"]),
        ("timeout: 90 s", "fi|", {"finally": "finally: ", "invert": "invert: "}, ["do"]),
        # names
        ("{goal: $target", "{goal: $|", {"$target": "$target", "$dock": "$dock"},
         ["$dwell", "$visited"]),
        ("wait: $dwell", "wait: $d|", {"$dwell": "$dwell"}, ["$dock", "$picture"]),
        ("with: {target: $stop}", "with: {target: |}", {"$stop": "$stop"}, ["$dwell"]),
        ("with: {target: $stop}", "with: {|}", {"target": "target: "}, ["picture"]),
        ("out: {picture: $photo}", "out: {|}", {"picture": "picture: "}, ["target"]),
        ("out: {image: $picture}", "out: {image: |}", {"$picture": "$picture"}, ["$target"]),
        ("use: inspect", "use: |", {"inspect": "inspect"}, ["wave"]),
        ("set: {visited: $visited + 1}", "set: {|}", {"visited": "visited: "}, ["dwell"]),
        ("battery.charge > 0.3", "battery.|", {"battery.charge": "battery.charge"}, []),
        # expressions at ports, placeholders, fields of poses, functions
        ("wait: $dwell", "wait: 2 * |", {"$dwell": "$dwell", "battery.charge": "battery.charge",
                                         "max": "max("}, ["timeout"]),
        ("wait: $dwell", "wait: |", {"$dwell": "$dwell", "min": "min("}, ["$dock"]),
        ("wait: $dwell", 'say: "at ${|"', {"dwell": "dwell", "$target": "$target",
                                           "pose.x": "pose.x", "distance": "distance("}, []),
        ("wait: $dwell", 'say: "$${|"', {}, ["pose.x"]),
        ("wait: $dwell", 'say: "${$target.|"', {"$target.x": "$target.x"}, ["$target", "dwell"]),
        ("wait: $dwell", "check: $target.h|", {"$target.heading": "$target.heading"}, ["$dwell"]),
        ("wait: $dwell", "check: $dwell.|", {}, ["$dwell.x", "$target"]),
        ("battery.charge > 0.3", "le|", {"length": "length("}, ["timeout"]),
        # the top
        ("start: dock", "localisation: |",
         {name: name for name in ("mcl", "dead_reckoning", "slam")},
         ["astar"]),
        ("start: dock", "localisation: {use: slam, |}",
         {"match_range": "match_range: "}, ["max_particles"]),
        ("planner: {use: astar, allow_unknown: true}", "|", {"loop": "loop: "}, ["localisation"]),
        ("start: dock", "sta|", {"start": "start: ", "events": "events: "}, ["wait"]),
        ("start: dock", "start: |", {"dock": "dock", "shelf": "shelf"}, ["visited"]),
        ("world: small_room", "world: |", {"office": "office"}, ["scout"]),
        ("robot: scout", "robot: |", {"scout": "scout", "jackal": "jackal"}, ["office"]),
        ("type: duration", "type: |", {"duration": "duration", "list of Pose": "list of Pose"}, []),
        ("{use: astar, allow_unknown: true}", "|", {"astar": "astar"}, ["pure_pursuit"]),
        ("allow_unknown: true", "|", {"allow_unknown": "allow_unknown: "}, ["cruise_speed"]),
        ("optional: true", "|", {"optional": "optional: ", "initial": "initial: "}, ["default"]),
        ("start: dock", "faults: [|]", {"push": "push: ", "wheel_slip": "wheel_slip: "}, ["wave"]),
        ("start: dock", "faults: [{|}]", {"push": "push: ", "at": "at: "}, ["wave"]),
        ("start: dock", "faults: [{lidar_dropout: {|}}]", {"share": "share: "}, ["push"]),
        # inside texts and expressions
        ("- wave: {times: 2}", '- say: "seen ${|}"',
         {"$visited": "$visited", "battery.charge": "battery.charge"}, ["wave"]),
        ("battery.charge > 0.3", "$dock.|", {"$dock.x": "$dock.x",
                                             "$dock.heading": "$dock.heading"}, ["battery.charge"]),
        ("wait: $dwell", "wait: $visited * mi|", {"$visited": "$visited", "min": "min("}, ["wave"]),
        ("wait: $dwell", "wait: $visited * |", {"battery.charge": "battery.charge"}, ["wave"]),
        # sections below a node
        ("timeout: 90 s", "recover: {|}", {"attempts": "attempts: ", "unless": "unless: ",
                                           "round_robin": "round_robin: "}, ["delay"]),
        ("timeout: 90 s", "recover:\n        un|", {"unless": "unless: "}, ["timeout"]),
        ("timeout: 90 s", "retry: {|}", {"delay": "delay: "}, ["unless"]),
        ("timeout: 90 s", "on_failure: |", {"continue": "continue", "fail": "fail"}, []),
        # tests
        ("trees:\n", "tests:\n  - {|}\ntrees:\n", {"mock": "mock: ", "expect": "expect: "},
         ["returns"]),
        ("trees:\n", "tests:\n  - mock: {|}\ntrees:\n",
         {"inspect": "inspect", "take_photo": "take_photo"}, ["sequence"]),
        ("trees:\n", "tests:\n  - mock: {take_photo: {|}}\ntrees:\n",
         {"returns": "returns: ", "takes": "takes: ", "sets": "sets: "}, ["expect"]),
        ("trees:\n", "tests:\n  - mock: {take_photo: {returns: |}}\ntrees:\n",
         {"success": "success", "NO_IMAGE": "NO_IMAGE"}, []),
        ("trees:\n", "tests:\n  - at: {1 s: {|}}\ntrees:\n",
         {"battery.charge": "battery.charge: ", "$visited": "$visited: ", "event": "event: "},
         ["time"]),
        ("trees:\n", "tests:\n  - expect: {|}\ntrees:\n",
         {"status": "status: ", "ran": "ran: ", "visited": "visited: "}, ["$key"]),
        ("trees:\n", "tests:\n  - expect: {failure: |}\ntrees:\n", {"LOST": "LOST"}, []),
        ("trees:\n", "tests:\n  - expect: {ran: {|}}\ntrees:\n", {"inspect": "inspect"}, []),
        ("trees:\n", "tests:\n  - arguments: {|}\ntrees:\n", {"dwell": "dwell: "}, ["visited"]),
    ],
)  # fmt: skip
def test_completion_of_a_text_that_is_being_typed(opened, old, marked, wanted, unwanted):
    assert old in MISSION
    piece = marked.replace("|", "")
    opened.change(MISSION.replace(old, piece, 1))
    start = MISSION.index(old)
    offset = start + marked.index("|")
    opened.at = lambda _: position(opened.text, offset)
    try:
        found = opened.complete(marked)
    finally:
        del opened.at
    assert {label: found.get(label) for label in wanted} == wanted
    assert not found.keys() & set(unwanted)


@pytest.mark.parametrize("text", ["", "# a new mission\n", "mis"])
def test_an_empty_file_offers_the_keys_of_a_mission(client, folder, text):
    client.open(folder / "new.yaml", text)
    client.at = lambda _: position(text, len(text))
    try:
        found = client.complete("|")
    finally:
        del client.at
    assert {"mission": "mission: ", "run": "run: "}.items() <= found.items()


def position(text, offset):
    before = text[:offset]
    return {"line": before.count("\n"), "character": len(before) - before.rfind("\n") - 1}


def test_completion_knows_the_names_below_an_open_bracket(opened):
    opened.hover("wav|e:")
    broken = MISSION.replace("with: {target: $stop}", "with: {target: $")
    opened.change(broken)
    assert "$stop" in opened.complete("with: {target: $|")


@settings(deadline=None, max_examples=40)
@given(st.integers(0, len(MISSION)), st.integers(0, len(MISSION)), st.sampled_from("x:${[]}'\n- #"))
def test_no_state_of_a_text_makes_it_stumble(at, until, letter):
    text = MISSION[:at] + letter + MISSION[until:]
    before = text[: at + 1]
    line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
    path = Path("patrol.yaml")
    assert all(finding.code in {*CODES, *YAML} for finding in findings_of(path, Draft(text)))
    found = read_at_cursor(text, path, line, column)
    if found:
        list(candidates(found.reading, found.word, alone=True))
    reading = read_words(text, path)
    for word in reading.words.items if reading else ():
        explanation(reading, word, str(word.node.value))
        definition(reading, word, str(word.node.value))
    if reading:
        outline(reading)


def test_without_pygls_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygls", None)
    with pytest.raises(InputError, match=r"pip install 'treepilot\[lsp\]'"):
        serve()


def test_checking_does_not_import_pygls():
    code = (
        "import sys, missions.cli.app, missions.inspection.check;"
        "heavy = {'pygls', 'lsprotocol', 'numba', 'pybullet', 'cv2', 'rerun', 'textual'};"
        "assert not heavy & sys.modules.keys(), heavy & sys.modules.keys()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False,
        cwd=ROOT, env={"PYTHONPATH": str(ROOT), "PATH": str(Path(sys.executable).parent)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
