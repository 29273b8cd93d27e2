"""Keep-out zones at the start, at goals and on every way: found by `check`, named by a run."""

import numpy as np
import pytest

from missions import run
from missions.inspection.diagnosis import findings_of
from stack.types import FREE, OCCUPIED, OccupancyGrid
from tests.stack.mapping.written_maps import write_ros_map

WORLD = """world: hall
format: 1
start: [1.5, 2.5, 0]
walls:
  - {points: [[0, 0], [8, 0], [8, 5], [0, 5]], closed: true}
"""
BED = "{name: bed, corners: [[0.8, 1.8], [2.2, 1.8], [2.2, 3.2], [0.8, 3.2]]}"


@pytest.fixture
def mission(tmp_path):
    (tmp_path / "hall.yaml").write_text(WORLD, "utf-8")

    def write(body, layer=f"{{use: keepout, zones: [{BED}]}}", start="[5, 2.5, 0]"):
        text = f"mission: m\nformat: 1\nrobot: scout\nworld: ./hall.yaml\nstart: {start}\n"
        layers = f"navigation: {{costmap: {{layers: [static, obstacle, {layer}]}}}}\n"
        file = tmp_path / "m.yaml"
        file.write_text(f"{text}{layers}run: {body}\n", "utf-8")
        return file

    return write


def found(file):
    return [(item.code, item.mark.line, item.sentence) for item in findings_of(file)]


def test_a_goal_in_a_zone_is_an_error_that_names_it(mission):
    goals = "{navigate_through: {goals: [[4, 1], [1.5, 2.5], [4, 4]]}}"
    assert found(mission(goals)) == [
        ("E182", 7, "the goal (1.5, 2.5) is in the keep-out zone 'bed'")
    ]
    near = found(mission("{navigate_to_pose: [2.4, 2.5]}"))
    assert near[0][2] == (
        "the goal (2.4, 2.5) is too near to the keep-out zone 'bed': 0.20 m, the robot needs 0.22 m"
    )
    assert found(mission("{navigate_to_pose: [2.45, 2.5]}"))[0][0] == "W140"
    assert found(mission("{navigate_to_pose: {goal: [1.5, 2.5], partial: true}}")) == []
    only_centre = f"{{use: keepout, inflated: false, zones: [{BED}]}}"
    assert found(mission("{navigate_to_pose: [2.4, 2.5]}", only_centre)) == []


def test_a_goal_in_a_mask_is_an_error_that_names_the_layer(mission, tmp_path):
    cells = np.full((50, 80), FREE, np.int8)
    cells[10:15, 10:20] = OCCUPIED  # x 1..2, y 1..1.5
    write_ros_map(OccupancyGrid(cells, 0.1), tmp_path / "mask.yaml")
    layer = "{use: keepout, name: painted, mask: mask.yaml}"
    assert found(mission("{navigate_to_pose: [1.5, 1.2]}", layer))[0][2].endswith("'painted'")
    assert found(mission("{navigate_to_pose: [2.3, 1.2]}", layer)) == []


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("{compute_path: [1.5, 2.5]}", "the goal (1.5, 2.5) is in"),
        ("{follow_waypoints: [[4, 1], [1.5, 2.5]]}", "the goal (1.5, 2.5) is in"),
        ("{for_each: {at: [[4, 1], [1.5, 2.5]]}, do: {inspect: {at: $at}}}", "the goal (1.5, 2.5)"),
        # scout's front is 0.224 m ahead, the drive ends 0.6 m before the dock
        ("{dock: [0.5, 2.5, 0]}", "the goal of dock (1.324, 2.5) is in"),
        ("{dock: {dock: [3.3, 2.5, 180 deg], staging: 1 m}}", "the goal of dock (2.076, 2.5) is"),
    ],
)
def test_every_place_to_which_a_behaviour_drives_is_compared_with_zones(mission, body, expected):
    ((code, line, sentence),) = found(mission(body))
    assert (code, line) == ("E182", 7)
    assert sentence.startswith(expected) and sentence.endswith("zone 'bed'")


def test_a_dock_in_a_zone_is_approached_by_sight(mission):
    assert found(mission("{dock: {dock: [2.1, 2.5, 0], staging: 1 m}}")) == []


INSIDE, ACROSS = "[[1, 2], [2, 2], [2, 3], [1, 3]]", "[[1.5, 2], [3, 2], [3, 3], [1.5, 3]]"


@pytest.mark.parametrize(
    ("area", "expected"),
    [
        (INSIDE, [("E184", 7, "the area is in the keep-out zone 'bed': the robot must not drive "
                   "there")]),
        ("[[0.7, 2], [2, 2], [2, 3], [0.7, 3]]",  # 10 cm outside are too narrow for the robot
         [("E184", 7, "the area is in the keep-out zone 'bed': the robot must not drive there")]),
        # 0.7 m of 1.5 m
        (ACROSS, [("W150", 7, "47% of the area is in the keep-out zone 'bed' and is left out")]),
        ("[[2.3, 2], [3, 2], [3, 3], [2.3, 3]]", []),
    ],
)  # fmt: skip
def test_an_area_in_a_zone_is_an_error_and_a_part_of_it_a_warning(mission, area, expected):
    assert found(mission(f"{{coverage: {{area: {area}}}}}")) == expected
    through = (
        f"{{use: clean, with: {{area: {area}}}}}\ntrees:\n  clean: {{in: {{area: list of Pose}}, "
    )
    assert found(mission(through + "do: {coverage: {area: $area}}}")) == expected


def test_two_zones_together_hold_an_area(mission):
    east = "{name: east, corners: [[2.2, 1.8], [3.2, 1.8], [3.2, 3.2], [2.2, 3.2]]}"
    layer = f"{{use: keepout, zones: [{BED}, {east}]}}"
    ((code, _, sentence),) = found(mission(f"{{coverage: {{area: {ACROSS}}}}}", layer))
    assert code == "E184" and "'bed' and 'east'" in sentence


def test_a_mission_with_other_errors_lists_its_goals_in_zones_too(mission):
    body = "{sequence: [{wait: {tme: 1 s}}, {navigate_to_pose: [1.5, 2.5]}]}"
    assert [code for code, *_ in found(mission(body))] == ["E130", "E182"]


def test_a_start_in_a_zone_is_a_warning_and_its_goals_are_reachable(mission):
    assert found(mission("{navigate_to_pose: [6, 2.5]}", start="[1.5, 2.5, 0]")) == [
        ("W146", 5, "the start (1.5, 2.5) is in the keep-out zone 'bed'")
    ]


def test_zones_that_close_every_way_are_named(mission):
    bars = "{use: keepout, zones: [{name: bar, corners: [[3, -1], [4, -1], [4, 4.6], [3, 4.6]]}]}"
    ((code, _, sentence),) = found(mission("{navigate_to_pose: [1, 2.5]}", bars))
    assert code == "W147"  # 0.4 m are left beside the wall, the robot is 0.44 m wide
    assert sentence.startswith(
        "the keep-out zone 'bar' closes the way from the start (5, 2.5) to the goal (1, 2.5); "
        "the nearest place that scout can reach is (4.3"
    )
    assert found(mission("{navigate_to_pose: [1, 2.5]}", bars.replace("4.6", "4.3"))) == []


def test_a_run_leaves_the_zone_in_which_it_starts_and_stays_outside(mission, tmp_path):
    file = mission("{sequence: [free_space_escape, {navigate_to_pose: [0.4, 2.5, 0]}]}",
                   start="[1.3, 2.5, 0]")  # fmt: skip
    report = run(file, seed=1, out=tmp_path / "run")
    assert report.status == "success"


def test_a_failure_names_the_zone(mission, tmp_path):
    bars = "{use: keepout, zones: [{name: bar, corners: [[3, -1], [4, -1], [4, 6], [3, 6]]}]}"
    report = run(mission("{navigate_to_pose: [1, 2.5]}", bars), seed=1, out=tmp_path / "run")
    assert report.status == "failure"
    assert "NO_VALID_PATH" in report.reason and report.reason.endswith("closes the way")
