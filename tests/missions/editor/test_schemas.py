"""The schemas: every shipped file passes the public validator, typical mistakes do not."""

import json
import re
from functools import cache
from pathlib import Path

import jsonschema
import pytest

from behaviours.catalogue import find_behaviours
from missions.editor.mission_schema import mission_schema
from missions.editor.robot_schema import robot_schema
from missions.editor.schemas import schema_text
from missions.editor.world_schema import world_schema
from missions.execution.resources import MISSIONS, catalogue_of, mission_files, world_files
from robots.load import read_robot
from stack.documents import Findings, read_file, read_text
from stack.errors import InputError
from stack.sim.worlds.world_file import read_world

ROOT = Path(__file__).parents[3]
ROBOTS = sorted((ROOT / "robots").glob("*/robot.yaml"))
SCHEMA = mission_schema(find_behaviours())
HEAD = "mission: m\nrobot: scout\nworld: office\n"


CHECK = jsonschema.Draft202012Validator(SCHEMA)
"""That the schemas are schemas is checked with the examples of the documentation."""


def validator(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@cache
def world_check():
    return jsonschema.Draft202012Validator(world_schema())


@cache
def robot_check():
    return jsonschema.Draft202012Validator(robot_schema())


def complaints(text):
    """What is wrong with a mission's text: `path: message`."""
    found = CHECK.iter_errors(read_text(text, "mission.yaml").plain())
    return [f"{'.'.join(map(str, error.absolute_path))}: {error.message}" for error in found]


@pytest.mark.parametrize("file", mission_files(), ids=lambda file: file.stem)
def test_every_shipped_mission_is_valid(file):
    top = read_file(file)
    plugins = top.get("plugins")
    check = CHECK
    if plugins:
        check = validator(mission_schema(catalogue_of(plugins.items, MISSIONS, Findings())))
    check.validate(top.plain())


@pytest.mark.parametrize("file", world_files(), ids=lambda file: file.stem)
def test_every_shipped_world_is_valid(file):
    world_check().validate(read_file(file).plain())


@pytest.mark.parametrize("file", ROBOTS, ids=lambda file: file.parent.name)
def test_every_shipped_robot_is_valid(file):
    robot_check().validate(read_file(file).plain())


@pytest.mark.parametrize(
    ("page", "schema"),
    [("language", SCHEMA), ("worlds", world_schema()), ("robots", robot_schema())],
    ids=["language", "worlds", "robots"],
)
def test_the_examples_of_the_documentation_are_valid(page, schema):
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    example = text.split("```yaml\n")[1].split("```")[0]
    validator(schema).validate(read_text(example, page).plain())


@pytest.mark.parametrize(
    "node",
    [
        "{wait: 3}",
        "{wait: 500 ms, name: a while, when: $n > 3, while: battery.charge > 10 %}",
        "{wait: {time: $dwell}, timeout: $limit, retry: {attempts: 3, delay: 1 s}, repeat: 2}",
        "{wait: $n * 2 s, timeout: 3 * $limit, repeat: $n + 1}",
        "{spin: {angle: 'max(10 deg, -pose.heading)'}}",
        "{navigate_to_pose: {goal: [$x + 1 m, 2, pose.heading]}}",
        "{navigate_to_pose: {goal: '$list[0]'}}",
        "{set: {seen: [$a, $b], word: 'at ${n}'}}",
        "relocalise",
        "{relocalise: }",
        "{take_photo: {}, out: {image: $photo}, on_failure: continue}",
        "{navigate_to_pose: [1, 2, 90 deg]}",
        "{navigate_to_pose: {goal: [1 m, 20 cm], tolerance: 30 cm}}",
        "{navigate_through: {goals: [$a, [1, 2]]}}",
        "{wall_follow: {side: $side}}",
        "{clear_costmap: both}",
        "{check: true}",
        "{check: {condition: battery.charge > 0.3}}",
        "{set: {visited: $visited + 1, seen: true}}",
        "{parallel: [wait: 1 s]}",
        "{parallel: {succeed_on: one, do: [wait: 1 s]}}",
        "{for_each: {a: [1, 2]}, do: {wait: $a}, on_failure: continue}",
        "{follow_waypoints: $a}",
        "{follow_waypoints: {waypoints: [$a, [1, 2]], tolerance: 20 cm}, do: take_photo, "
        "on_failure: continue, out: {missed: $missed, reached: $n, distance: $way}}",
        "{use: tree, with: {a: 1}, out: {b: $b}}",
        "{switch: {value: $mode, cases: {fast: {wait: 1}, slow: relocalise}, default: {say: a}}}",
        "{wait: 1, finally: {say: a}, invert: true, repeat: {until: time > 3}}",
        "{wait: 1, repeat: forever}",
        "{unset: $photo}",
        "{unset: [$photo, $n]}",
        "{fail: {code: LOST, because: no map}}",
        "{fail: no map}",
        "{compute_path: {goal: $dock}, out: {path: $path}}",
        "{follow_path: $path}",
        "{follow_path: [[0, 0], [1, 0, 90 deg]]}",
        "py_trees.behaviours.Success",
        "{py_trees.behaviours.TickCounter: {duration: 3}, timeout: 3 s}",
        "{spin: 90 deg, recover: {attempts: 2, unless: error == LOST, round_robin: [wait: 1 s]}}",
    ],
)
def test_what_may_be_written(node):
    assert complaints(f"{HEAD}run: {node}") == []


@pytest.mark.parametrize(
    ("node", "complaint"),
    [
        ("{navigate_to_pos: $dock}", "run: 'navigate_to_pos' does not match"),
        ("{wait: 2 m * 3}", "run.wait: '2 m * 3' does not match"),
        ("{wait: 2 m}", "run.wait: '2 m' does not match"),
        ("{wait: {time: 90 deg}}", "run.wait.time: '90 deg' does not match"),
        ("{wait: -1}", "run.wait: -1 is less than the minimum of 0"),
        ("{wait: {tme: 1 s}}", "run.wait: 'time' is a required property"),
        ("{wait: {time: 1 s, tme: 1 s}}", "run.wait: Additional properties are not allowed ('tme'"),
        ("{wait: }", "run.wait: None is not of type"),
        ("wait", "run: 'wait' does not match"),
        ("sequence", "run: 'sequence' does not match"),
        ("{wait: 1 s, say: hello}", "run: 'say' is not one of ['wait', 'name'"),
        ("{wait: 1 s, timout: 3 s}", "run: 'timout' is not one of ['wait', 'name'"),
        ("{wait: 1 s, timeout: 0}", "run.timeout: 0 is less than or equal to the minimum of 0"),
        ("{wait: 1 s, retry: 0}", "run.retry: 0 is less than the minimum of 1"),
        ("{wait: 1 s, retry: {delay: 1 s}}", "run.retry: 'attempts' is a required property"),
        ("{wait: 1 s, repeat: often}", "run.repeat: 'often' does not match"),
        ("{wait: 1 s, on_failure: ignore}", "run.on_failure: 'ignore' is not one of"),
        ("{wait: 1 s, with: {time: 3 s}}", "run: 'with' is not one of"),
        ("{wait: 1 s, out: {a: $a}}", "run: 'out' is not one of"),
        ("{take_photo: {}, out: {imge: $a}}", "run.out: Additional properties are not allowed"),
        ("{take_photo: {}, out: {image: a}}", "run.out.image: 'a' does not match"),
        ("{sequence: []}", "run.sequence: [] should be non-empty"),
        ("{sequence: {wait: 1 s}}", "run.sequence: {'wait': '1 s'} is not of type 'array'"),
        ("{sequence: [{wait: 1 s}, {wait: 1 m}]}", "run.sequence.1.wait: '1 m' does not match"),
        ("{timeout: 3 s}", "run: {'timeout': '3 s'} should not be valid"),
        ("{}", "run: {} should not be valid"),
        ("{for_each: {a: [1]}}", "run: 'do' is a required property"),
        ("{for_each: {a: [1], b: [2]}, do: {wait: 1}}", "run.for_each: {'a': [1], 'b': [2]} has"),
        ("{follow_waypoints: {tolerance: 1 m}}", "run.follow_waypoints: 'waypoints' is a requ"),
        ("{follow_waypoints: $a, out: {mised: $n}}", "run.out: Additional properties are not"),
        ("{follow_waypoints: $a, with: {b: 1}}", "run: 'with' is not one of"),
        ("{parallel: {fail_on: one, do: [wait: 1]}}", "run.parallel: Additional properties are"),
        ("{wall_follow: {side: lefft}}", "run.wall_follow.side: 'lefft' does not match '^(left|"),
        ("{navigate_to_pose: [1]}", "run.navigate_to_pose: [1] is too short"),
        ("{navigate_to_pose: [1, 2, 3 m]}", "run.navigate_to_pose.2: '3 m' does not match"),
        ("{navigate_through: {goals: [dock]}}", "run.navigate_through.goals.0: 'dock' does not"),
        ("3", "run: 3 is not of type 'string', 'object'"),
        ("{switch: {value: $a}}", "run.switch: 'cases' is a required property"),
        ("{switch: {value: $a, case: {}}}", "run.switch: Additional properties are not"),
        ("{switch: {value: $a, cases: {b: {wait: 1 m}}}}", "run.switch.cases.b.wait: '1 m' does"),
        ("{wait: 1, repeat: {until: a, times: 3}}", "run.repeat: Additional properties are not"),
        ("{wait: 1, invert: maybe}", "run.invert: 'maybe' is not of type 'boolean'"),
        ("{follow_path: [[0, 0]]}", "run.follow_path: [[0, 0]] is too short"),
    ],
)  # fmt: skip
def test_typical_mistakes_in_nodes_are_refused(node, complaint):
    found = complaints(f"{HEAD}run: {node}")
    assert any(line.startswith(complaint) for line in found), found


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("wrld: office", "Additional properties are not allowed ('wrld'"),
        ("safety: {}", "Additional properties are not allowed ('safety'"),
        ("format: 2", "format: 2 is not one of [1]"),
        ("start: [1]", "start: [1] is too short"),
        ("places: {dock-2: [1, 2]}", "places: 'dock-2' does not match"),
        ("places: {dock: [1 s, 2]}", "places.dock.0: '1 s' does not match"),
        ("arguments: {n: {type: integer}}", "arguments.n.type: 'integer' does not match"),
        ("arguments: {n: 3}", "arguments.n: 3 is not of type 'object'"),
        ("blackboard: {n: {type: int, inital: 0}}", "blackboard.n: Additional properties"),
        ("navigation: {planer: astar}", "navigation: Additional properties are not allowed"),
        ("navigation: {planner: {tolerance: 1 s}}", "navigation.planner.tolerance: '1 s' does"),
        ("navigation: {planner: {use: astar, weight: 3}}", "navigation.planner: 'weight' is not"),
        ("plugins: ./mine", "plugins: './mine' is not of type 'array'"),
        ("trees: {a: {in: {n: number}, do: relocalise}}", "trees.a.in.n: 'number' does not"),
        ("trees: {a: {}}", "trees.a: 'do' is a required property"),
        ("events: [{lost: {when: time > 3}}]", "events.0.lost: 'do' is a required property"),
        ("tests: [{nam: a}]", "tests.0: Additional properties are not allowed ('nam'"),
        ("tests: [{expect: {status: fine}}]", "tests.0.expect.status: 'fine' is not one of"),
        ("tests: [{mock: {wait: {take: 3 s}}}]", "tests.0.mock.wait: Additional properties"),
        ("events: [{lost: {when: 1, do: relocalise, then: stop}}]", "events.0.lost.then: 'stop'"),
    ],
)
def test_typical_mistakes_at_the_top_are_refused(text, complaint):
    found = complaints(f"{HEAD}run: relocalise\n{text}")
    assert any(complaint in line for line in found), found


@pytest.mark.parametrize(
    "text",
    [
        "events: [{low: {when: battery.charge < $least, hold: 2 s, do: relocalise, then: abort}}]",
        "include: [common.yaml]",
        "tests: [{name: a}, {mock: {wait: real, say: [failure, success], spin: {takes: [1 s, 2]}},"
        " expect: {visited: 2, order: [a, b], within: {wait: 3 s}, ran: {wait: [1, 2]}}}]",
        "tests: [{name: a, mock: {wait: {takes: 3 s}}, at: {4 s: {battery.charge: 0.1}},"
        " expect: {status: success, ran: {wait: 2}, within: 10 min}}]",
        "arguments: {a: {type: list of Pose, default: [$dock]}, b: {type: int, range: [0, 3]}}",
        "navigation: {planner: astar, controller: {cruise_speed: 30 cm/s}}",
        "navigation: {planner: from_an_installed_package}",
        "start: dock\ninitial_pose: unknown\nmap: ./map.yaml",
    ],
)
def test_what_may_stand_at_the_top(text):
    assert complaints(f"{HEAD}run: relocalise\n{text}") == []


def keys_of(read, file):
    """The keys that a reader knows at the top of its file, from what it says of an unknown one."""
    with pytest.raises(InputError) as caught:
        read(file)
    [hint] = [item.hint for item in caught.value.findings if "'zzzzzzzz'" in item.sentence]
    return set(re.sub("available: ", "", hint).split(", "))


def test_the_schema_of_worlds_has_every_key_of_the_reader(tmp_path):
    file = tmp_path / "world.yaml"
    file.write_text("world: w\nzzzzzzzz: 1\n")
    assert set(world_schema()["properties"]) == keys_of(read_world, file)


SKID = "{drive: skid_steered, left: [a], right: [b], radius: 1, track: 1"
SIDES = "{left: [a], right: [b], radius: 1 cm, separation: 30 cm}"
MOUNTS = "[{joint: a, at: [0, 0, 0]}, {joint: b, at: [1, 0, 0]}, {joint: c, at: [0, 1, 90 deg]}]"


@pytest.mark.parametrize(
    ("wheels", "complaint"),
    [
        (SIDES, None),
        (SIDES.replace("{", "{drive: differential, "), None),
        (f"{{drive: omni, radius: 5 cm, mounts: {MOUNTS}}}", None),
        (
            "{drive: skid_steered, left: [a], right: [b], radius: 1, track: 1, effective_track: 2}",
            None,
        ),
        (
            "{drive: skid_steered, left: [a], right: [b], radius: 1, track: 1}",
            "'effective_track' is",
        ),
        (SIDES.replace("{", "{drive: tracks, "), "does not match"),
        (SIDES.replace("{", "{drive: omni, "), "'mounts' is a required property"),
        (SIDES.replace("{", "{track: 1, "), "False schema does not allow 1"),
        (SIDES.replace("{", "{trak: 1, "), "'trak' was unexpected"),
        (f"{{drive: omni, radius: 1, track: 1, mounts: {MOUNTS}}}", "False schema does not allow"),
        ("{drive: omni, radius: 1, mounts: [{joint: a, at: [0, 0, 0]}]}", "is too short"),
        ("{drive: ackermann, radius: 1}", "'wheelbase' is a required property"),
    ],
)
def test_the_schema_of_wheels_goes_by_their_kind(wheels, complaint):
    text = f"robot: r\nfootprint: {{radius: 1}}\nheight: 1\nurdf: r.urdf\nwheels: {wheels}\n"
    found = robot_check().iter_errors(read_text(text, "robot.yaml").plain())
    messages = [error.message for error in found]
    assert not messages if complaint is None else any(complaint in m for m in messages), messages


def test_the_schema_of_robots_has_every_key_of_the_reader(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text("robot: r\nzzzzzzzz: 1\n")
    assert set(robot_schema()["properties"]) == keys_of(read_robot, file)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("walls: [{points: [[0, 0]]}]", "is too short"),
        ("walls: [{points: [[0, 0], [1, 1]], colour: [2, 0, 0]}]", "2 is greater than the maximum"),
        ("boxes: [{at: [0, 0]}]", "'size' is a required property"),
        ("timeline: [{when: {time: 3 s}, battery: 0.1, open_door: a}]", "should not be valid"),
        ("timeline: [{when: {tme: 3 s}, battery: 0.1}]", "('tme' was unexpected)"),
    ],
)
def test_typical_mistakes_in_worlds_are_refused(text, complaint):
    node = read_text(f"world: w\n{text}", "world.yaml").plain()
    found = [error.message for error in world_check().iter_errors(node)]
    assert any(complaint in line for line in found), found


def test_a_broken_plugin_is_named(tmp_path, monkeypatch):
    (tmp_path / "broken.py").write_text("import nothing_of_that_name\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"broken\.py: line 1: cannot import"):
        schema_text("mission", ["./broken.py"])


def test_ports_carry_their_documentation():
    port = SCHEMA["$defs"]["node"]["properties"]["wall_follow"]["properties"]["side"]
    assert port["examples"] == ["left", "right"]
    assert "left | right" in port["markdownDescription"]
    assert "wall" in SCHEMA["$defs"]["node"]["properties"]["wall_follow"]["markdownDescription"]
    assert json.loads(schema_text("mission")) == SCHEMA
