"""What users of today's navigation stacks suffer from, and the tests that it does not happen here.

Each entry is a complaint from the trackers of Nav2 (n), slam_toolbox (s) or the old navigation
stack (o), by number; the tests named for it must exist. Those that stand nowhere else are below.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import missions

TESTS = Path(__file__).parents[1]

PAINS = {
    "n1655 a spin above half a turn never ends": ["test_every_spin_ends_after_its_angle"],
    "n2453 backing up never ends when blocked": ["test_backing_up_stops_before_a_wall_and_fails"],
    "n5625 inflation closes a door that the robot fits through": [
        "test_a_gap_narrower_than_the_robot_closes_the_place_behind_it",
        "test_a_wide_gap_is_open_and_the_picture_is_drawn",
    ],
    "n4808, n6100 paths hug the walls": [
        "test_paths_keep_to_the_middle_of_a_corridor_and_of_doors"
    ],
    "n4049, n5189 a misplaced or misspelt parameter goes unnoticed": [
        "test_a_wrong_parameter_is_refused_with_its_name"
    ],
    "n3111 a value is silently overridden elsewhere": [
        "test_each_value_names_the_file_and_line_that_sets_it"
    ],
    "n3746, n3352 wall time and simulated time mix": [
        "test_equal_seeds_give_equal_logs_whatever_the_speed_and_the_recording"
    ],
    "n6556, n2917, n2491, n4960 bring-up hangs without a word": [
        "test_help_teaches_and_imports_nothing_heavy",
        "test_the_mission_outlives_its_viewers_and_a_later_one_attaches",
    ],
    "n2696, n3770 nobody can watch the tree live": [
        "test_the_mission_outlives_its_viewers_and_a_later_one_attaches"
    ],
    "n3180, n3508, n2847 a faulty tree crashes the navigator": [
        "test_faulty_nodes",
        "test_faulty_files",
    ],
    "n3090 it drives to a cancelled goal": [
        "test_a_mission_that_is_cancelled_lets_go_of_its_goal_and_stands",
        "test_a_cancelled_drive_leaves_the_robot_standing",
    ],
    "n4655, o18 planning fails for a goal that can be reached": [
        "test_reachable_means_found_and_at_the_least_cost",
        "test_two_hundred_offices_and_not_one_failure",
    ],
    "n4243, n4993 planning on large maps is slow": [
        "test_a_maze_longer_than_the_first_range_and_queue_is_solved_all_the_same"
    ],
    "n5531, n5375 it wobbles on the way": ["test_nothing_wobbles_on_a_straight_way"],
    "n4921, n1492 it swings about the goal": [
        "test_the_goal_is_met_and_not_swung_about",
        "test_a_goal_counts_after_a_while_within_though_moving",
    ],
    "n4043, n3661, n2915 ghosts in the costmap": [
        "test_a_lethal_cell_says_which_layer_and_source_marked_it_and_when"
    ],
    "n4349, n1733, n1509, n2797 system tests are flaky": [
        "test_equal_seeds_give_equal_logs_whatever_the_speed_and_the_recording"
    ],
    "s720, s543, s465 messages hide the cause": [
        "test_an_old_or_missing_scan_stops_the_robot_and_says_so"
    ],
    "s334, s769, s285, s771 the pose gets worse and nobody notices": [
        "test_a_lost_robot_stops_and_says_so",
        "test_without_a_camera_the_kidnapped_robot_does_not_guess",
    ],
    "n341 localisation believes a wrong initial pose": [
        "test_a_wrong_initial_pose_is_noticed_and_mended"
    ],
}


def test_every_pain_has_its_tests() -> None:
    known = {
        item.name
        for file in TESTS.rglob("test_*.py")
        for item in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(item, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    assert {name for names in PAINS.values() for name in names} - known == set()


LOST = """
mission: a
robot: scout
world: office
start: dock
initial_pose: [{x}, {y}, {heading} deg]
run:
  navigate_to_pose: {{goal: $meeting}}
  recover: {{attempts: 3, round_robin: [relocalise, {{spin: 360 deg}}]}}
"""


@pytest.mark.parametrize(("x", "y", "heading"), [(1.3, 5.0, 0), (1.1, 5.3, 15), (5.8, 5.0, 180)])
def test_a_wrong_initial_pose_is_noticed_and_mended(
    x: float, y: float, heading: float, tmp_path: Path
) -> None:
    """The dock is at (0.8, 5.0, 0): half a metre off, a bit and 15 degrees, 5 m and half a turn."""
    path = tmp_path / "lost.yaml"
    path.write_text(LOST.format(x=x, y=y, heading=heading), "utf-8")
    report = missions.run(path, seed=1)
    assert (report.status, report.collisions) == ("success", 0)
    end = report.final_pose
    assert abs(end["estimate"]["x"] - end["truth"]["x"]) < 0.1


STRAIGHT = """
mission: a
robot: scout
world: two_corridors
start: [1.5, 7.6, 0 deg]
navigation: {{controller: {controller}}}
run: {{navigate_to_pose: {{goal: [6.5, 7.6, 0 deg], tolerance: 0.1}}}}
"""
CONTROLLERS = ("pure_pursuit", "mppi", "dwb", "graceful")


@pytest.fixture(scope="module", params=CONTROLLERS)
def straight_way(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> list[tuple[float, float, float]]:
    """(x, y, heading) of the truth at every control step of five metres straight on."""
    folder = tmp_path_factory.mktemp(request.param)
    path = folder / "straight.yaml"
    path.write_text(STRAIGHT.format(controller=request.param), "utf-8")
    return driven(path)


def driven(path: Path) -> list[tuple[float, float, float]]:
    from missions.execution.build import build, run_info
    from missions.execution.prepare import RunOptions, prepare
    from stack.telemetry.hub import Telemetry

    options = RunOptions(serve=False)
    plan = prepare(path, options)
    engine = build(plan, options, Telemetry(run_info(plan, "a", 0)), None)
    poses = []
    try:
        while not engine.runtime.state.is_over:
            engine.runtime.step()
            pose = engine.body.truth.pose
            poses.append((pose.x, pose.y, pose.heading))
    finally:
        engine.runtime.parts.navigator.close()
        engine.body.close()
    assert engine.runtime.state == "success", engine.runtime.reason
    return poses


def swings(values: list[float], least: float) -> int:
    """How often a value turns back by more than `least`."""
    count, direction, farthest = 0, 0, values[0]
    for value in values:
        change = value - farthest
        if direction == 0 and abs(change) > least:
            direction, farthest = (1 if change > 0.0 else -1), value
        elif change * direction > 0.0:
            farthest = value
        elif -change * direction > least:
            count, direction, farthest = count + 1, -direction, value
    return count


def test_nothing_wobbles_on_a_straight_way(
    straight_way: list[tuple[float, float, float]],
) -> None:
    """At most two swings of the heading by more than 3 degrees, over five metres."""
    assert swings([heading for _, _, heading in straight_way], 0.05) <= 2


def test_the_goal_is_met_and_not_swung_about(
    straight_way: list[tuple[float, float, float]],
) -> None:
    x, y, heading = straight_way[-1]
    assert ((x - 6.5) ** 2 + (y - 7.6) ** 2) ** 0.5 < 0.12  # the tolerance and 2 cm of estimate
    assert abs(heading) < 0.2
    last_metre = [x for x, _, _ in straight_way if x > 5.5]
    assert swings(last_metre, 0.02) == 0
