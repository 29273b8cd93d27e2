"""Keep-out zones at the start, at goals and on every way: found by `check`, named by a run."""

import numpy as np
import pytest

from missions import run
from missions.inspection.diagnosis import findings_of
from stack.mapping.ros_map import write_ros_map
from stack.types import FREE, OCCUPIED, OccupancyGrid

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


def test_a_start_in_a_zone_is_a_warning_and_its_goals_are_reachable(mission):
    assert found(mission("{navigate_to_pose: [6, 2.5]}", start="[1.5, 2.5, 0]")) == [
        ("W144", 5, "the start (1.5, 2.5) is in the keep-out zone 'bed'")
    ]


def test_zones_that_close_every_way_are_named(mission):
    bars = "{use: keepout, zones: [{name: bar, corners: [[3, -1], [4, -1], [4, 4.6], [3, 4.6]]}]}"
    ((code, _, sentence),) = found(mission("{navigate_to_pose: [1, 2.5]}", bars))
    assert code == "W145"  # 0.4 m are left beside the wall, the robot is 0.44 m wide
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
