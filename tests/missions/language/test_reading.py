"""Reading of valid missions."""

import subprocess
import sys

import pytest

from missions.language.codes import CODES
from missions.trees.compiler import compile_mission
from stack.errors import InputError
from stack.types import Pose2D
from tests.missions.mission_fakes import read_text

MISSION = """
mission: office patrol
format: 1
doc: Look at the desks.
robot: scout
world: office
start: lobby
initial_pose: unknown
map: none
places: {desk: [1, 2, 90 deg], lobby: [0, 1]}
navigation:
  controller: pure_pursuit
  planner: {use: astar, allow_unknown: true}
arguments:
  goals: {type: list of Pose, default: [$desk, [4, 5]]}
  dwell: {type: duration, default: 3 s}
  say:   {type: text, default: hello, one_of: [hello, bye]}
blackboard: {photo: {type: path, optional: true}}
run: {sequence: [{for_each: {goal: $goals}, do: {navigate_to_pose: $goal}}, {wait: $dwell}, {say: $say}]}
"""  # noqa: E501


def test_the_header_of_a_mission(tmp_path):
    mission = read_text(tmp_path, MISSION)
    assert (mission.name, mission.robot, mission.world) == ("office patrol", "scout", "office")
    assert (mission.map, mission.initial_pose, mission.doc) == (
        "none", "unknown", "Look at the desks.",
    )  # fmt: skip
    assert mission.start == Pose2D(0.0, 1.0)  # the mission's own lobby comes before the world's
    assert mission.source == tmp_path / "mission.yaml"
    assert [item.code for item in mission.warnings] == ["W102"]


def test_defaults(tmp_path):
    mission = read_text(tmp_path, "run: {say: hello}")
    assert (mission.start, mission.initial_pose, mission.map) == (None, "start", "from_world")
    assert mission.places == {"lobby": Pose2D(9.0, 9.0)}


def test_arguments_have_their_defaults_or_overrides(tmp_path):
    assert read_text(tmp_path, MISSION).arguments["dwell"] == 3.0
    mission = read_text(
        tmp_path, MISSION, dwell="500 ms", goals="[$lobby, [7, 8, 180 deg]]", say="bye"
    )
    assert mission.arguments["dwell"] == 0.5
    assert mission.arguments["say"] == "bye"
    lobby, other = mission.arguments["goals"]
    assert (lobby, other.x, other.y) == (Pose2D(0.0, 1.0), 7.0, 8.0)


def test_an_option_cannot_leave_an_arguments_choices(tmp_path):
    with pytest.raises(InputError, match=r"--set say:1:1 error\[E109\] say: 'hi' is not one of"):
        read_text(tmp_path, MISSION, say="hi")


def test_parameter_files_come_before_the_missions_own(tmp_path):
    (tmp_path / "slow.yaml").write_text(
        "controller: {use: pure_pursuit, cruise_speed: 0.2, lookahead: 1 m}\n"
        "planner: {use: dijkstra, weight: 3}\n"
    )
    (tmp_path / "slower.yaml").write_text("controller: {cruise_speed: 0.1}\n")
    mission = read_text(
        tmp_path,
        "parameters: [slow.yaml, slower.yaml]\n"
        "navigation: {planner: {use: astar, allow_unknown: true}}\n"
        "run: {say: hello}",
    )
    controller, planner = mission.components["controller"], mission.components["planner"]
    assert controller.use == "pure_pursuit"
    assert controller.values == {"cruise_speed": 0.1, "lookahead": "1 m"}
    assert controller.marks["cruise_speed"].file == str(tmp_path / "slower.yaml")
    # Another component: it keeps those parameters of the first one that it has too.
    assert planner.use == "astar"
    assert planner.values["allow_unknown"] is True


@pytest.mark.parametrize(
    "value", ["on", "yes", "off", "012", "1:30", "0x10", "1_000", "=", "2026-01-01"]
)
def test_yaml_traps_are_closed(tmp_path, value):
    mission = read_text(tmp_path, f"run: {{say: '{value}'}}")
    assert mission.root.ports["text"].value == value


def test_plain_words_that_yaml_1_1_takes_for_booleans_are_texts(tmp_path):
    assert read_text(tmp_path, "run: {say: on}").root.ports["text"].value == "on"


def test_quoted_dollars_are_texts(tmp_path):
    mission = read_text(tmp_path, "run: {say: '$lobby'}")
    assert mission.root.ports["text"].value == "$lobby"
    assert mission.warnings == ()


def test_anchors_work(tmp_path):
    mission = read_text(tmp_path, "run: {sequence: [&look {wait: 1 s}, *look]}")
    assert [child.kind for child in mission.root.children()] == ["wait", "wait"]


@pytest.mark.parametrize(
    "node", ["wait: 3 s", "wait: {time: 3 s}", "wait: {time: 3000 ms}", "wait: 3", "wait: 0.05 min"]
)
def test_a_bare_value_sets_the_only_required_port(tmp_path, node):
    mission = read_text(tmp_path, f"run: {{{node}}}")
    assert mission.root.ports["time"].value == pytest.approx(3.0)


@pytest.mark.parametrize(
    "guard",
    [
        "{say: $photo, when: $photo is set}",
        "{sequence: [{check: $photo is set}, {say: $photo}]}",
        "{parallel: [{say: $photo}, {take_photo: {}, out: {image: $photo}}]}",
        "{sequence: [{take_photo: {}, out: {image: $photo}}, {say: $photo}]}",
        "{parallel: [{say: $photo}, {sequence: [{use: look, out: {it: $photo}}]}]}",
        "{sequence: [{use: look, out: {it: $photo}}, {say: $photo}]}",
        "{sequence: [{set: {photo: \"'a'\"}}, {say: $photo}]}",
    ],
)
def test_keys_that_may_have_been_written_can_be_read(tmp_path, guard):
    read_text(
        tmp_path,
        f"""
        blackboard: {{photo: {{type: path, optional: true}}}}
        run: {guard}
        trees:
          look: {{out: {{it: path}}, do: {{take_photo: {{}}, out: {{image: $it}}}}}}
        """,
    )


def test_every_code_says_what_to_do():
    assert all(code[0] in "EW" and len(code) == 4 for code in CODES)
    assert all(item.title and item.cause and item.fix for item in CODES.values())


def compiled_with_calls(folder, count):
    """A sequence of so many drives with four nodes each, and the calls that compiling it took."""
    desks = "\n".join(
        f"    - {{navigate_to_pose: [1, {n}], timeout: 9 s, retry: 2, when: time < 9 min}}"
        for n in range(count)
    )
    calls = 0

    def count_call(frame, event, argument):
        nonlocal calls
        calls += event == "call"

    previous = sys.getprofile()
    sys.setprofile(count_call)
    try:
        tree = compile_mission(read_text(folder, f"run:\n  sequence:\n{desks}\n"))
    finally:
        sys.setprofile(previous)
    return tree, calls


def test_the_work_of_reading_and_compiling_grows_with_the_number_of_nodes(tmp_path):
    compiled_with_calls(tmp_path, 1)  # fills caches
    _, few = compiled_with_calls(tmp_path, 40)
    tree, many = compiled_with_calls(tmp_path, 160)
    assert len(tree.rows()) == 1 + 160 * 4
    assert many < 4.2 * few


def test_reading_and_compiling_import_nothing_heavy():
    program = (
        "import sys, missions.language.reading.mission\n"
        "import missions.trees.compiler, missions.trees.show\n"
        "heavy = {'numba', 'pybullet', 'cv2', 'rerun', 'textual', 'zmq', 'pymavlink'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert found.stdout.strip() == "[]", found.stderr
