"""Nav2 parameter files: which parameters are imported, which are listed, which are refused."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from missions.cli.app import app
from missions.execution.prepare import RunOptions, prepare
from missions.nav2.reading import Nav2Settings, read_nav2
from missions.nav2.reporting import lines_of, parameter_file, warnings_of
from stack.errors import InputError
from tests.missions.nav2.nav2_texts import SHIPPED, check, read, values


def controller(plugin: str, **parameters: object) -> Nav2Settings:
    """The settings of a controller server with one controller."""
    server = {"controller_plugins": ["FollowPath"], "FollowPath": {"plugin": plugin, **parameters}}
    return read(yaml.safe_dump({"controller_server": {"ros__parameters": server}}))


def test_the_shipped_file_chooses_what_it_says() -> None:
    found = read_nav2(SHIPPED)
    assert {kind: chosen.use for kind, chosen in found.kinds.items()} == {
        "navigator": None, "controller": "mppi", "planner": "astar", "costmap": None,
        "safety": None, "goal_checker": "simple_goal", "progress_checker": "simple_progress",
    }  # fmt: skip
    assert values(found, "goal_checker") == {"position": 0.2, "heading": 0.3}
    assert values(found, "progress_checker") == {"distance": 0.4, "time": 12.0}
    assert values(found, "planner") == {
        "tolerance": 0.125, "allow_unknown": False, "cost_weight": 2.5,
        "smoother": "savitzky_golay",
    }  # fmt: skip
    layers = values(found, "costmap")["layers"]
    assert isinstance(layers, list)
    assert [layer["use"] for layer in layers] == ["static", "sensors", "sensors"]
    assert values(found, "costmap") == {
        "layers": layers, "inflation_radius": 0.7, "cost_scaling": 3.0, "resolution": 0.05,
    }  # fmt: skip


def test_what_has_no_equivalent_is_listed_with_a_reason() -> None:
    reasons = {item.path: item.reason for item in read_nav2(SHIPPED).ignored}
    assert reasons["amcl.use_sim_time"] == "there is one clock, the robot's"
    assert reasons["local_costmap.robot_radius"] == "the footprint in robot.yaml is used"
    assert reasons["smoother_server.simple_smoother.window_size"] == "no equivalent"


def test_every_value_of_the_file_is_taken_or_listed() -> None:
    text = SHIPPED.read_text("utf-8")
    found = read_nav2(SHIPPED)
    listed = {item.mark.line for item in (*found.imported, *found.ignored)}
    structure = ("plugins", "critics", "enabled: True", "observation_sources", "polygons", "type:")
    for number, line in enumerate(text.splitlines(), start=1):
        key, _, value = line.strip().partition(":")
        if value.strip() and not key.startswith("#") and not any(w in line for w in structure):
            assert number in listed or "Checker" in line, line


def test_pure_pursuit_with_a_fixed_lookahead() -> None:
    found = controller(
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
        max_linear_vel=0.4, lookahead_dist=0.5, use_velocity_scaled_lookahead_dist=False,
        use_regulated_linear_velocity_scaling=False, min_distance_to_obstacle=-1.0,
    )  # fmt: skip
    assert found.kinds["controller"].use == "pure_pursuit"
    assert values(found, "controller") == {
        "cruise_speed": 0.4, "min_lookahead": 0.5, "max_lookahead": 0.5, "min_radius": 0.0,
    }  # fmt: skip


def test_map_grid_scales_count_half_a_metre_and_costs_become_shares() -> None:
    """MapGridCritic scales cells by resolution / 2; a cost of 252 is our share of one."""
    found = controller(
        "dwb_core::DWBLocalPlanner",
        min_vel_x=-0.1, PathDist={"scale": 32.0}, BaseObstacle={"scale": 0.02},
    )  # fmt: skip
    assert values(found, "controller") == pytest.approx(
        {"reverse_speed": 0.1, "path_distance_weight": 16.0, "obstacle_weight": 5.04}
    )


def test_dotted_keys_mean_the_same_as_nested_ones() -> None:
    found = controller("dwb_core::DWBLocalPlanner", **{"PathDist.scale": 32.0})
    assert values(found, "controller")["path_distance_weight"] == pytest.approx(16.0)


def test_a_rotation_shim_turns_first_and_passes_to_its_controller() -> None:
    found = controller(
        "nav2_rotation_shim_controller::RotationShimController",
        primary_controller="nav2_graceful_controller::GracefulController",
        angular_dist_threshold=0.6, forward_sampling_distance=0.5, v_linear_max=0.35,
    )  # fmt: skip
    assert found.kinds["controller"].use == "graceful"
    assert values(found, "controller") == {
        "rotate_angle": 0.6, "rotate_lookahead": 0.5, "cruise_speed": 0.35,
    }  # fmt: skip


def test_critics_that_are_not_listed_weigh_nothing() -> None:
    found = controller(
        "nav2_mppi_controller::MPPIController",
        critics=["GoalCritic"], GoalCritic={"cost_weight": 7.0}, PathAlignCritic={"cost_weight": 9},
    )  # fmt: skip
    mppi = values(found, "controller")
    assert mppi["goal_weight"] == 7.0
    assert mppi["path_align_weight"] == 0.0


def test_servers_are_found_under_a_namespace() -> None:
    found = read("/rover:\n  planner_server:\n    ros__parameters: {expected_planner_frequency: 1}")
    assert [item.path for item in found.ignored] == ["planner_server.expected_planner_frequency"]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a: {b: 1}", "not a Nav2 parameter file"),
        (
            "controller_server: {ros__parameters: {failure_tolerance: soon}}",
            "controller_server.failure_tolerance: 'soon' is not a value that Nav2 accepts",
        ),
    ],
)
def test_a_file_that_will_not_do_is_refused_with_its_place(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as refused:
        read(text)
    assert refused.value.findings[0].code == "E116"


def test_the_missions_own_settings_win() -> None:
    plan = prepare("19_from_nav2", RunOptions())
    mppi = plan.choices["controller"].parameters
    assert plan.choices["controller"].name == "mppi"
    assert (mppi.cruise_speed, mppi.batch) == (0.5, 1500)
    assert [zone.action for zone in plan.choices["safety"].parts] == ["stop", "approach"]
    assert {finding.code for finding in plan.mission.warnings} == {"W110"}


def test_a_value_out_of_our_range_is_a_warning_in_their_file(tmp_path: Path) -> None:
    """16 is the least `batch` of mppi."""
    text = SHIPPED.read_text("utf-8").replace("batch_size: 1500", "batch_size: 3")
    found = check(tmp_path, text)
    assert found.plan is not None
    assert found.plan.choices["controller"].parameters.batch == 16
    finding = next(item for item in found.findings if item.code == "W112")
    line = text.splitlines().index("      batch_size: 3") + 1
    assert (finding.mark.file, finding.mark.line) == (str(tmp_path / "nav2.yaml"), line)
    assert finding.sentence.startswith("controller_server.FollowPath.batch_size: 3 is outside")


def test_the_command_lists_and_writes_a_parameter_file(tmp_path: Path) -> None:
    out = tmp_path / "ours.yaml"
    result = CliRunner().invoke(app, ["nav2", str(SHIPPED), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "FollowPath.vx_max  ->  controller.cruise_speed = 0.45" in result.output
    (tmp_path / "a.yaml").write_text(
        "mission: a\nrobot: scout\nworld: office\nparameters: [ours.yaml]\nrun: {wait: 1 s}\n",
        "utf-8",
    )
    plan = prepare(tmp_path / "a.yaml", RunOptions())
    assert plan.choices["controller"].parameters.cruise_speed == 0.45


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_a_damaged_file_is_read_or_refused(data: st.DataObject) -> None:
    """Whatever stands in the place of a line: an InputError or lists, nothing else."""
    lines = SHIPPED.read_text("utf-8").splitlines()
    at = data.draw(st.integers(0, len(lines) - 1))
    key = lines[at].partition(":")[0]
    odd = st.sampled_from(["", ": []", ": {}", ": soon", ": [[1]]", ": -1", ": null", ": true"])
    lines[at] = key + data.draw(odd)
    try:
        found = read("\n".join(lines))
    except InputError:
        return
    assert list(lines_of(found))
    assert parameter_file(found, "a")
    warnings_of(found)


def costmaps(local: dict[str, object], whole: dict[str, object]) -> dict[str, object]:
    """What is imported from two costmaps with one inflation layer each."""
    plugin = {"plugin": "nav2_costmap_2d::InflationLayer"}
    servers = {
        f"{which}_costmap": {
            f"{which}_costmap": {
                "ros__parameters": {"plugins": ["inflation"], "inflation": {**plugin, **layer}}
            }
        }
        for which, layer in (("local", local), ("global", whole))
    }
    return values(read(yaml.safe_dump(servers)), "costmap")


def test_costmaps_that_inflate_differently_keep_their_values() -> None:
    found = costmaps(
        {"inflation_radius": 0.3, "cost_scaling_factor": 5.0},
        {"inflation_radius": 0.7, "cost_scaling_factor": 5.0},
    )
    assert found == {"inflation_radius": 0.7, "local_inflation_radius": 0.3, "cost_scaling": 5.0}


def test_a_costmap_without_inflation_gets_the_radius_0() -> None:
    found = costmaps({"enabled": False}, {"inflation_radius": 0.7})
    assert found == {"inflation_radius": 0.7, "local_inflation_radius": 0.0}
    assert costmaps({"enabled": False}, {"enabled": False}) == {"inflation_radius": 0.0}


def test_checkers_are_imported_by_their_class() -> None:
    server = {
        "goal_checker_plugins": ["precise"],
        "precise": {"plugin": "nav2_controller::StoppedGoalChecker", "xy_goal_tolerance": 0.05},
        "progress_checker_plugins": ["progress"],
        "progress": {
            "plugin": "nav2_controller::PoseProgressChecker", "required_movement_angle": 0.5,
            "required_movement_radius": 0.5, "movement_time_allowance": 10.0,
        },
    }  # fmt: skip
    found = read(yaml.safe_dump({"controller_server": {"ros__parameters": server}}))
    assert found.kinds["goal_checker"].use == "stopped_goal"
    assert values(found, "goal_checker") == {"position": 0.05}
    assert found.kinds["progress_checker"].use == "pose_progress"
    assert values(found, "progress_checker") == {"angle": 0.5, "distance": 0.5, "time": 10.0}
