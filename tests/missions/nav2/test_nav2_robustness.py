"""Nav2 parameter files of any robot and version: what Nav2 accepts is neither refused nor lost."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missions.execution.prepare import RunOptions, diagnose, prepare
from missions.nav2 import equivalents as tables
from missions.nav2.importer import class_name
from missions.nav2.reading import Nav2Settings, read_nav2
from stack.costmap.choosing import LayerChoice
from stack.errors import InputError
from tests.missions.nav2.nav2_texts import PURE_PURSUIT, SHIPPED, check, read, values


def layered(local: list[str], whole: list[str], plugin: str = "") -> Nav2Settings:
    """The settings of two costmaps with these layers; `odd` is of the class `plugin`."""
    classes = {
        "static": "nav2_costmap_2d::StaticLayer", "voxel": "nav2_costmap_2d::VoxelLayer",
        "inflation": "nav2_costmap_2d::InflationLayer", "odd": plugin,
    }  # fmt: skip
    servers = {
        f"{which}_costmap": {
            f"{which}_costmap": {
                "ros__parameters": {
                    "plugins": names, **{name: {"plugin": classes[name]} for name in names},
                }
            }
        }
        for which, names in (("local", local), ("global", whole))
    }  # fmt: skip
    return read(yaml.safe_dump(servers))


@settings(deadline=None, max_examples=40)
@given(st.text(st.characters(categories=["L", "N"], include_characters="_:/"), min_size=1))
def test_a_layer_of_any_other_class_leaves_the_sensors(plugin: str) -> None:
    assume(class_name(plugin) not in tables.LAYERS)
    found = layered(["odd", "inflation"], ["static", "odd", "inflation"], plugin)
    layers = values(found, "costmap")["layers"]
    assert layers == [{"use": "static", "only": "global"}, {"use": "sensors", "only": "both"}]
    warnings = [item for item in found.warnings if item.code == "W113"]
    assert [item.sentence.partition(":")[0] for item in warnings] == [
        "global_costmap.odd.plugin", "local_costmap.odd.plugin",
    ] or plugin == "PluginContainerLayer"  # fmt: skip


def test_a_local_costmap_without_a_layer_that_senses_is_a_warning() -> None:
    found = layered(["static"], ["static", "voxel"])
    assert any("senses" in item.sentence for item in found.warnings)
    assert not layered(["voxel"], ["static"]).warnings


def test_a_masked_layer_is_a_warning_that_says_what_to_write() -> None:
    found = layered(["voxel", "odd"], ["voxel"], "nav2_costmap_2d::KeepoutFilter")
    assert [item.code for item in found.warnings] == ["W113"]
    assert "keepout" in found.warnings[0].hint


def test_several_sources_reach_as_far_as_the_farthest() -> None:
    layer = {
        "plugin": "nav2_costmap_2d::ObstacleLayer", "observation_sources": "front  rear",
        "front": {"obstacle_max_range": 2.0, "raytrace_max_range": 6.0},
        "rear": {"obstacle_max_range": 4.0, "raytrace_max_range": 5.0},
    }  # fmt: skip
    server = {"ros__parameters": {"plugins": ["obstacles"], "obstacles": layer}}
    both = {f"{which}_costmap": {f"{which}_costmap": server} for which in ("local", "global")}
    found = read(yaml.safe_dump(both))
    assert values(found, "costmap")["layers"] == [
        {"use": "sensors", "only": "both", "obstacle_range": 4.0, "clearing_range": 6.0}
    ]
    assert not found.ignored


@pytest.mark.parametrize("robot", ["scout", "glide", "scout_depth", "buggy", "jackal"])
def test_the_layers_are_those_of_the_robots_sensors(tmp_path: Path, robot: str) -> None:
    usual = prepare_with(tmp_path, robot, "")
    imported = prepare_with(tmp_path, robot, f"navigation: {{nav2_params: {SHIPPED}}}")
    for only in ("global", "local"):
        names = {
            layer.name.removeprefix(f"{only}_"): layer.values.get("source", "lidar")
            for layer in imported if layer.only in ("both", only)
        }  # fmt: skip
        expected = {layer.name: layer.values.get("source", "lidar") for layer in usual}
        assert {**names, "static": "lidar"} == expected


def prepare_with(tmp_path: Path, robot: str, navigation: str) -> tuple[LayerChoice, ...]:
    text = f"mission: a\nrobot: {robot}\nworld: office\n{navigation}\nrun: {{wait: 1 s}}\n"
    (tmp_path / "a.yaml").write_text(text, "utf-8")
    parts: tuple[LayerChoice, ...] = (
        prepare(tmp_path / "a.yaml", RunOptions()).choices["costmap"].parts
    )
    return parts


@pytest.mark.parametrize(
    "plugin", ["teb_local_planner::TebLocalPlannerROS", "neo_local_planner/NeoLocalPlanner"]
)
def test_a_controller_without_an_equivalent_leaves_its_speed_limits(
    tmp_path: Path, plugin: str
) -> None:
    server = {
        "controller_plugins": ["FollowPath"],
        "FollowPath": {"plugin": plugin, "max_vel_x": 0.3, "max_vel_theta": 0.7},
    }
    text = yaml.safe_dump({"controller_server": {"ros__parameters": server}})
    found = check(tmp_path, text)
    assert found.plan is not None
    chosen = found.plan.choices["controller"]
    assert (chosen.name, chosen.parameters.cruise_speed) == ("pure_pursuit", 0.3)
    assert chosen.parameters.turn_speed == 0.7
    finding = next(item for item in found.findings if item.code == "W113")
    assert plugin in finding.sentence
    assert finding.mark.file.endswith("nav2.yaml")
    other = check(tmp_path, text, ", controller: mppi").plan
    assert other is not None
    assert other.choices["controller"].parameters.cruise_speed == 0.3


NUMBERS = st.one_of(
    st.sampled_from([0.0, -1.0, 1e-9, 1e9, 10.0, 0, 1, -1, 1000]),
    st.floats(-100.0, 100.0), st.integers(-1000, 1000), st.just("LAUNCH"),
)  # fmt: skip


@settings(deadline=None, max_examples=25)
@given(data=st.data())
def test_no_number_is_refused(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """A number in place of a number: warnings, but the mission is ready to start."""
    lines = SHIPPED.read_text("utf-8").splitlines()
    numbered = [at for at, line in enumerate(lines) if line.split(": ")[-1][-1].isdigit()]
    for at in data.draw(st.lists(st.sampled_from(numbered), min_size=1, max_size=4)):
        key, _, old = lines[at].rpartition(": ")
        new = data.draw(NUMBERS)
        if new == "LAUNCH":
            new = "$(var value)"
        elif "." not in old:
            new = int(new)
        lines[at] = f"{key}: {new}"
    found = check(tmp_path_factory.mktemp("nav2"), "\n".join(lines))
    assert found.plan is not None, found.findings


@pytest.mark.parametrize(
    ("plugin", "key", "value"),
    [
        ("nav2_mppi_controller::MPPIController", "vy_max", 0.0),
        ("nav2_mppi_controller::MPPIController", "vy_std", 0.0),
        (PURE_PURSUIT, "min_approach_linear_velocity", 0.0),
        (PURE_PURSUIT, "min_lookahead_dist", 0.0),
        (PURE_PURSUIT, "max_lookahead_dist", 0.2),
        (PURE_PURSUIT, "regulated_linear_scaling_min_speed", 0.0),
        (PURE_PURSUIT, "lookahead_time", ".inf"),
    ],
)
def test_a_zero_that_turns_something_off_in_nav2_is_accepted(
    tmp_path: Path, plugin: str, key: str, value: object
) -> None:
    server = {"controller_plugins": ["FollowPath"], "FollowPath": {"plugin": plugin, key: value}}
    text = yaml.safe_dump({"controller_server": {"ros__parameters": server}}).replace("'", "")
    found = check(tmp_path, text)
    assert found.plan is not None
    codes = [item.code for item in found.findings]
    assert codes == ([] if value == 0.0 and key == "vy_max" else codes)
    assert all(key in item.sentence or "lookahead" in item.sentence for item in found.findings)


def test_the_last_of_equal_keys_counts() -> None:
    found = read(
        "controller_server:\n  ros__parameters:\n    controller_plugins: [FollowPath]\n"
        "    FollowPath:\n      plugin: dwb_core::DWBLocalPlanner\n"
        "      max_vel_x: 0.2\n      max_vel_x: 0.25\n      max_vel_x: 0.3\n"
    )
    assert values(found, "controller") == {"cruise_speed": 0.3}
    assert [(item.mark.line, item.code) for item in found.warnings] == [(7, "W111"), (8, "W111")]
    assert "line 7" in found.warnings[1].sentence


def test_equal_keys_of_a_mission_are_an_error(tmp_path: Path) -> None:
    text = "mission: a\nmission: b\nrobot: scout\nworld: office\nrun: {wait: 1 s}\n"
    (tmp_path / "a.yaml").write_text(text, "utf-8")
    assert "E011" in [item.code for item in diagnose(tmp_path / "a.yaml").findings]


SERVER = {
    "controller_plugins": ["FollowPath"],
    "FollowPath": {"plugin": PURE_PURSUIT, "desired_linear_vel": 0.2},
}


def dotted(values: dict[str, object], above: str = "") -> dict[str, object]:
    found: dict[str, object] = {}
    for key, value in values.items():
        inner = isinstance(value, dict)
        found |= dotted(value, f"{above}{key}.") if inner else {above + key: value}  # type: ignore[arg-type]
    return found


@pytest.mark.parametrize("parameters", [SERVER, dotted(SERVER)])
@pytest.mark.parametrize(
    "path",
    [
        ["controller_server"], ["/controller_server"], ["/robot1/controller_server"],
        ["robot1", "controller_server"], ["/fleet", "robot1/controller_server"], ["/**"],
        ["/**/controller_server"], ["robot1", "/**"], ["/robot1/**"],
    ],
)  # fmt: skip
def test_a_server_is_found_by_any_name(path: list[str], parameters: dict[str, object]) -> None:
    document: dict[str, object] = {"ros__parameters": parameters}
    for name in reversed(path):
        document = {name: document}
    found = read(yaml.safe_dump(document))
    assert found.kinds["controller"].use == "pure_pursuit"
    assert values(found, "controller") == {"cruise_speed": 0.2}


def test_a_nodes_own_value_counts_before_that_of_all_nodes() -> None:
    own = {"FollowPath.desired_linear_vel": 0.3}
    servers = {"controller_server": own, "/**": SERVER}
    found = read(yaml.safe_dump({name: {"ros__parameters": p} for name, p in servers.items()}))
    assert values(found, "controller") == {"cruise_speed": 0.3}


def test_one_of_several_robots_is_chosen_by_its_namespace(tmp_path: Path) -> None:
    text = "".join(
        f"robot{number}:\n  planner_server:\n    ros__parameters:\n"
        f"      planner_plugins: [GridBased]\n"
        f"      GridBased: {{plugin: nav2_navfn_planner/NavfnPlanner, tolerance: 0.{number}}}\n"
        for number in (1, 2)
    )
    with pytest.raises(InputError, match="2 robots: /robot1, /robot2"):
        read(text)
    for name in ("robot2", "/robot2"):
        assert values(read_nav2(Path("a"), text, name), "planner")["tolerance"] == 0.2
    with pytest.raises(InputError, match="no robot with the namespace /robot3"):
        read_nav2(Path("a"), text, "robot3")
    check(tmp_path, text)
    mission = "mission: a\nrobot: scout\nworld: office\nrun: {wait: 1 s}\n"
    chosen = "navigation: {nav2_params: {file: nav2.yaml, namespace: /robot2}}\n"
    (tmp_path / "a.yaml").write_text(mission + chosen, "utf-8")
    plan = prepare(tmp_path / "a.yaml", RunOptions())
    assert plan.choices["planner"].parameters.tolerance == 0.2


def test_recoveries_and_goal_checkers_of_foxy_are_imported() -> None:
    found = read(
        "controller_server:\n  ros__parameters:\n    goal_checker_plugin: precise\n"
        "    precise: {plugin: 'nav2_controller::SimpleGoalChecker', xy_goal_tolerance: 0.4}\n"
        "recoveries_server:\n  ros__parameters: {max_rotational_vel: 0.4}\n"
    )
    assert values(found, "goal_checker") == {"position": 0.4}
    assert values(found, "navigator") == {"spin_speed": 0.4}


def test_words_of_yaml_1_1_are_true_and_false_in_ros() -> None:
    found = layered(["static", "odd"], ["static", "voxel"], "a::VoxelLayer")
    assert not found.warnings
    layer = "plugins: [v], v: {plugin: VoxelLayer, enabled: off}"
    text = "".join(
        f"{which}_costmap:\n  {which}_costmap: {{ros__parameters: {{{layer}}}}}\n"
        for which in ("local", "global")
    )
    assert values(read(text), "costmap") == {"inflation_radius": 0.0}


def test_a_velocity_polygon_is_a_zone_for_each_range_of_speeds() -> None:
    corners = "'[[0.4, 0.3], [0.4, -0.3], [-0.3, 0.0]]'"
    found = read(
        "collision_monitor:\n  ros__parameters:\n    polygons: [Fast, Broken]\n"
        "    Fast:\n      type: velocity_polygon\n      action_type: stop\n"
        "      velocity_polygons: [forward, back]\n"
        f"      forward: {{points: {corners}, linear_min: 0.0, linear_max: 1.0}}\n"
        f"      back: {{points: {corners}, linear_min: -1.0, linear_max: 0.0}}\n"
        "    Broken: {type: polygon, action_type: limit, linear_limit: 0.0, polygon_sub_topic: x}\n"
    )
    zones = values(found, "safety")["zones"]
    assert isinstance(zones, list)
    assert [zone["name"] for zone in zones] == ["Fast forward", "Fast back", "Broken"]
    assert [zone.get("speed_to") for zone in zones] == [1.0, 0.0, None]
    assert [item.code for item in found.warnings] == ["W113"]
