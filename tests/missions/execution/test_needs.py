"""Behaviours, components and layers on robots without their sensors are refused by `check`."""

from dataclasses import replace
from pathlib import Path

import pytest

from behaviours.catalogue import find_behaviours
from missions.execution.fit.needs import behaviour_needs
from missions.execution.resources import load_robot
from missions.inspection.diagnosis import findings_of
from missions.inspection.listing import description_of, installed
from robots.load import robot_names
from stack.components import BUILT_IN, component
from stack.drivetrain.needs import NEEDS, alternatives, lacking, needs_problem
from stack.drivetrain.needs import SENSORS as KINDS
from tests.missions.mission_fakes import read_text

SCOUT_URDF = load_robot("scout", Path()).urdf
ALL = load_robot("scout", Path())
BLIND = replace(ALL, lidar=None, camera=None, imu=None, sonars={}, depth_cameras={})
"""The scout has every kind of sensor; BLIND has none."""
SENSORS = {
    "lidar": "lidar: {position: [0, 0]}\n",
    "rear lidar": "lidars: {rear: {position: [-10 cm, 0], yaw: 180 deg}}\n",
    "camera": "camera: {position: [10 cm, 0, 30 cm], width: 320, height: 240, "
    "field_of_view: 70 deg}\n",
    "depth camera": "depth_cameras: {depth: {position: [10 cm, 0, 30 cm]}}\n",
}
HEAD = "mission: a\nformat: 1\nworld: office\n"
ARM = load_robot("panda_table", Path())

GUARDED = {
    "follow_line": "{until_time: 30 s}", "follow_person": "{until_time: 30 s}",
    "wall_follow": "{until_time: 30 s}", "dock": "$lobby", "explore": "{}",
    "detect_markers": "{}", "relocalise": "{}", "localise_globally": "{}", "disambiguate": "{}",
    "take_photo": "{}", "inspect": "{}", "find_object": "{colour: red}",
    "approach_object": "{colour: red}", "wait_for_door": "$lobby", "free_space_escape": "{}",
}  # fmt: skip


GRASPING = {
    "move_arm": "{posture: home}", "home_arm": "{}", "open_gripper": "{}", "close_gripper": "{}",
    "detect_blocks": "{}",
    "look_at": "{point: {x: 50 cm, z: 20 cm}}", "pick": "{}", "place": "{block: red}",
}  # fmt: skip
"""Behaviours that need an arm or a gripper."""


@pytest.mark.parametrize(("kind", "ports"), GRASPING.items())
def test_a_behaviour_of_an_arm_is_refused_on_a_rover(tmp_path, kind, ports):
    mission = read_text(tmp_path, f"run: {{{kind}: {ports}}}\n")
    found = behaviour_needs(mission, ALL)
    assert found and {item.code for item in found} == {"E183"}
    assert behaviour_needs(mission, ARM) == []


def robot_file(folder, *sensors, radius="22 cm"):
    """Write a robot with these sensors to `folder/robot`."""
    (folder / "robot").mkdir()
    (folder / "robot" / "robot.yaml").write_text(
        f"robot: mine\nformat: 1\nfootprint: {{radius: {radius}}}\nheight: 38 cm\n"
        f"urdf: {SCOUT_URDF}\n"
        "wheels: {left: [left_wheel], right: [right_wheel], radius: 7.5 cm, separation: 29 cm}\n"
        + "".join(SENSORS[name] for name in sensors)
    )


def found(folder, text, *sensors, **robot):
    """`code line` of every finding of a mission for a robot with these sensors."""
    robot_file(folder, *sensors, **robot)
    file = folder / "mission.yaml"
    file.write_text(f"{HEAD}robot: ./robot\n{text}")
    return list(findings_of(file))


def codes(items):
    return [f"{item.code} {item.mark.line}" for item in items]


def test_every_need_of_what_is_built_in_is_in_the_table():
    catalogue = find_behaviours()
    declared = [catalogue.get(name).needs for name in catalogue.names()]
    declared += [component(kind, name).needs for kind, names in BUILT_IN.items() for name in names]
    names = {one for needs in declared for need in needs for one in alternatives(need)}
    assert names and names <= set(NEEDS)
    sensing = {name for name in catalogue.names() if {*catalogue.get(name).needs} - {"base"}}
    assert sensing == {*GUARDED, *GRASPING}


@pytest.mark.parametrize("need", KINDS)
def test_a_need_is_met_by_the_robot_that_has_the_sensor(need):
    assert list(lacking((need,), ALL)) == []
    assert list(lacking((need,), BLIND)) == [need]
    others = " or ".join(name for name in KINDS if name != need)
    only = {"lidar": {"lidar": ALL.lidar}, "camera": {"camera": ALL.camera},
            "depth_camera": {"depth_cameras": ALL.depth_cameras}, "sonar": {"sonars": ALL.sonars},
            "imu": {"imu": ALL.imu}}  # fmt: skip
    assert list(lacking((need, others), replace(BLIND, **only[need]))) == [others]


@pytest.mark.parametrize(("kind", "ports"), GUARDED.items())
def test_a_behaviour_without_its_sensor_is_refused_where_it_is_used(tmp_path, kind, ports):
    text = f"places: {{lobby: [1, 2]}}\nrun:\n  sequence:\n    - say: a\n    - {kind}: {ports}\n"
    mission = read_text(tmp_path, text)
    [finding] = behaviour_needs(mission, BLIND)
    assert (finding.code, finding.mark.line, finding.severity) == ("E183", 5, "error")
    assert finding.sentence.startswith(f"{kind} needs a ")
    assert "scout" in finding.hint  # a robot that has it
    assert behaviour_needs(mission, ALL) == []


def test_an_arm_on_a_column_has_no_drive_and_a_rover_no_arm(tmp_path):
    assert list(lacking(("base", "arm", "gripper"), ARM)) == ["base"]
    assert list(lacking(("base", "arm", "gripper"), ALL)) == ["arm", "gripper"]


MOVES = {
    "navigate_to_pose": "[1, 2]", "spin": "90 deg", "back_up": "{distance: 20 cm}",
    "clear_costmap": "{}", "compute_path": "[1, 2]", "save_map": "{}",
    "set_pose": "[1, 2]",
}  # fmt: skip


@pytest.mark.parametrize(("kind", "ports"), MOVES.items())
def test_what_needs_a_drive_is_refused_on_an_arm_and_says_nothing_of_sensors(tmp_path, kind, ports):
    mission = read_text(tmp_path, f"run:\n  sequence:\n    - say: a\n    - {kind}: {ports}\n")
    [finding] = behaviour_needs(mission, ARM)
    assert (finding.code, finding.mark.line) == ("E183", 4)
    assert finding.sentence == f"{kind} needs a drive, and panda_table has none"
    assert "scout" in finding.hint and "panda_table" not in finding.hint


def test_a_behaviour_that_is_used_often_is_one_finding(tmp_path):
    text = "run: {sequence: [take_photo, {use: again}]}\ntrees: {again: {do: take_photo}}"
    assert codes(behaviour_needs(read_text(tmp_path, text), BLIND)) == ["E183 1"]


def test_a_robot_without_a_lidar_is_not_localised_by_a_lidar(tmp_path):
    [finding] = found(tmp_path, "run: {wait: 3 s}\n", "camera")
    assert (finding.code, finding.mark.line) == ("E183", 4)  # the default: at `robot`
    assert finding.sentence == (
        "the estimator 'mcl' needs a lidar, and mine has none; it has camera (camera)"
    )
    names = ", ".join(name for name in robot_names() if load_robot(name, Path()).all_lidars)
    assert finding.hint == (
        f"write `localisation: dead_reckoning`, or use a robot with a lidar: {names}"
    )


def test_an_estimator_that_is_named_is_refused_at_its_name(tmp_path):
    text = "map: none\nlocalisation: slam\nrun: {wait: 3 s}\n"
    assert codes(found(tmp_path, text)) == ["E183 6"]


@pytest.mark.parametrize(
    "text",
    [
        "localisation: dead_reckoning\nrun: {wait: 3 s}\n",
        "map: none\nrun: {wait: 3 s}\n",
        "navigation: {markers: {localise: true}}\nrun: {wait: 3 s}\n",  # mcl by markers
    ],
)
def test_what_works_without_a_lidar_is_not_reported(tmp_path, text):
    assert found(tmp_path, text, "camera") == []


def test_a_layer_without_its_sensor_is_refused(tmp_path):
    text = "navigation: {costmap: {layers: [static, obstacle, range, depth]}}\nrun: {wait: 3 s}\n"
    items = found(tmp_path, text, "lidar")
    assert codes(items) == ["E183 5"] * 2
    assert [item.sentence.split(", and")[0] for item in items] == [
        "the layer 'range' needs a sonar", "the layer 'depth' needs a depth camera",
    ]  # fmt: skip


def test_a_lidar_in_no_layer_is_reported_and_a_layer_of_no_lidar(tmp_path):
    front = "{use: obstacle, source: lidar}"
    text = f"navigation: {{costmap: {{layers: [static, {front}]}}}}\nrun: {{wait: 3 s}}\n"
    [finding] = found(tmp_path, text, "lidar", "rear lidar")
    assert (finding.code, finding.severity) == ("W144", "warning")
    assert "{use: obstacle, name: obstacle_rear, source: rear}" in finding.hint
    wrong = text.replace(front, "obstacle, {use: obstacle, name: back, source: rare}")
    (tmp_path / "wrong").mkdir()
    [finding] = found(tmp_path / "wrong", wrong, "lidar", "rear lidar")
    assert finding.code == "E183" and "available: lidar, rear" in finding.hint


def test_lists_that_read_every_lidar_and_the_default_are_fine(tmp_path):
    rear = "{use: obstacle, name: obstacle_rear, source: rear}"
    for name, layers in (("named", f"obstacle, {rear}"), ("all", "obstacle")):
        (tmp_path / name).mkdir()
        text = f"navigation: {{costmap: {{layers: [static, {layers}]}}}}\nrun: {{wait: 3 s}}\n"
        assert found(tmp_path / name, text, "lidar", "rear lidar") == []
    (tmp_path / "usual").mkdir()
    assert found(tmp_path / "usual", "run: {wait: 3 s}\n", "lidar", "rear lidar") == []


@pytest.mark.parametrize(
    ("depth", "layers", "expected"),
    [
        ("obstacles: true", "static, obstacle", ["W144 5"]),
        ("obstacles: true", "static, sensors", []),
        ("obstacles: true", "static, obstacle, {use: depth, name: tables}", []),
        ("obstacles: false", "static, obstacle", []),
    ],
)
def test_depth_obstacles_that_no_layer_draws_are_reported(tmp_path, depth, layers, expected):
    costmap = f"costmap: {{layers: [{layers}]}}"
    text = f"navigation: {{depth: {{{depth}}}, {costmap}}}\nrun: {{wait: 3 s}}\n"
    items = found(tmp_path, text, "lidar", "depth camera")
    assert codes(items) == expected


@pytest.mark.parametrize(
    ("settings", "radius", "expected"),
    [
        ("inflation_radius: 22 cm", "22 cm", ["W145 5"]),
        ("inflation_radius: 23 cm", "22 cm", []),
        ("local_inflation_radius: 10 cm", "22 cm", ["W145 5"]),
        ("inflation_radius: 10 cm, local_inflation_radius: 0", "22 cm", ["W145 5"] * 2),
        ("inflation_radius: 10 cm, turning_cost: 100", "22 cm", []),  # reaches beyond by itself
        ("denoise: true", "60 cm", ["W145 5"]),  # the default of 55 cm
    ],
)
def test_an_inflation_within_the_robot_is_reported(tmp_path, settings, radius, expected):
    text = f"navigation: {{costmap: {{{settings}}}}}\nrun: {{wait: 3 s}}\n"
    assert codes(found(tmp_path, text, "lidar", radius=radius)) == expected


@pytest.mark.parametrize(
    "switch", ["depth: {obstacles: true}", "place_recognition: {record: true}"]
)
def test_a_setting_that_switches_on_a_missing_sensor_is_refused(tmp_path, switch):
    text = f"navigation: {{{switch}}}\nrun: {{wait: 3 s}}\n"
    assert codes(found(tmp_path, text, "lidar")) == ["E183 5"]


@pytest.mark.parametrize(
    ("needs", "problem"),
    [
        (("camera",), ""),
        (("lidar or sonar", "imu"), ""),
        ("camera", 'write needs = ("camera",)'),
        (("lidar or rader",), "'rader' is not one of lidar, camera"),
    ],
)
def test_needs_of_plugins_are_checked(needs, problem):
    assert problem in needs_problem(needs)
    assert bool(needs_problem(needs)) is bool(problem)


def test_a_plugin_that_needs_what_nobody_knows_is_refused_by_name(tmp_path):
    (tmp_path / "radar.py").write_text(
        "from behaviours.base import RobotBehaviour\n"
        "class Sweep(RobotBehaviour):\n    '''Sweep.'''\n    needs = ('radar',)\n"
        "    def update(self): ...\n"
    )
    [problem] = find_behaviours(["./radar.py"], tmp_path).problems
    assert "Sweep: needs: 'radar' is not one of lidar, camera" in problem.sentence


def test_descriptions_show_the_needs():
    known = installed()
    assert "\nneeds: drive, camera\n" in description_of("follow_line", known)
    assert "\nneeds: lidar\n" in description_of("mcl", known)
    assert "needs:" not in description_of("wait", known)


def test_the_nodes_of_an_event_of_a_tree_are_checked_like_any_other(tmp_path):
    text = (
        "trees:\n"
        "  look:\n"
        "    events:\n"
        "      - low: {when: battery.charge < 0.2, do: take_photo, then: abort}\n"
        "    do: {wait: 1 s}\n"
        "run: {use: look}\n"
    )
    assert "E183 8" in codes(found(tmp_path, text, "lidar"))
