"""People who walk through a hall: MPPI asks for tracks of them and keeps its distance."""

from __future__ import annotations

import pytest

from missions.execution.build import build, run_info
from missions.execution.prepare import RunOptions, prepare
from missions.execution.running import run_mission
from stack.errors import InputError
from stack.telemetry.hub import Telemetry
from stack.types import LETHAL_COST, Pose2D

WORLD = """world: hall
format: 1
bounds: [-0.5, -0.5, 12.5, 8.5]
start: [2, 4, 0]
walls:
  - {{points: [[0, 0], [12, 0], [12, 8], [0, 8]], closed: true}}
people:
  - name: Ada
    waypoints: {way}
    speed: {speed} m/s
"""
MISSION = """mission: through the hall
format: 1
robot: scout
world: hall.yaml
start: [2, 4, 0]
navigation:
  controller: {{use: mppi, moving_weight: {weight}}}
  tracker: {{confirm: 3}}
  costmap: {{layers: [static, obstacle, social]}}
run:
  navigate_to_pose: {{goal: [8, 4, 0]}}
  timeout: 60 s
"""
WALKS = {"crossing": ([[6.0, 7.3], [6.0, 0.7]], 0.8), "head-on": ([[11.0, 4.1], [1.0, 4.1]], 0.7)}


@pytest.fixture
def mission(tmp_path):
    def write(walk="crossing", weight=150.0):
        way, speed = WALKS[walk]
        (tmp_path / "hall.yaml").write_text(WORLD.format(way=way, speed=speed), "utf-8")
        path = tmp_path / "through.yaml"
        path.write_text(MISSION.format(weight=weight), "utf-8")
        return path

    return write


def test_a_controller_that_asks_for_tracks_gets_a_tracker_as_the_mission_sets_it(mission):
    plan = prepare(mission(), RunOptions(serve=False))
    telemetry = Telemetry(run_info(plan, "test", 0), [], lambda text: None)
    engine = build(plan, RunOptions(serve=False), telemetry, None)
    tracker = engine.runtime.parts.perceiver.world_model.tracker
    engine.body.close()
    assert tracker is not None
    assert tracker.parameters.confirm == 3


def test_settings_of_the_tracker_are_checked(mission):
    path = mission()
    path.write_text(path.read_text("utf-8").replace("confirm: 3", "confirms: 3"), "utf-8")
    with pytest.raises(InputError, match=r"no parameter 'confirms'.*did you mean 'confirm'"):
        prepare(path, RunOptions())


@pytest.mark.slow
@pytest.mark.parametrize("walk", WALKS)
def test_it_keeps_clear_of_people_in_the_simulation(mission, walk):
    runs = {
        weight: run_mission(mission(walk, weight), RunOptions(seed=1, serve=False))
        for weight in (150.0, 0.0)
    }
    for report in runs.values():
        assert (report.status, report.collisions, report.pushed_into) == ("success", 0, 0)
    assert runs[150.0].min_clearance_m > runs[0.0].min_clearance_m + 0.15
    assert runs[150.0].min_clearance_m > 0.3


@pytest.mark.parametrize(
    ("navigation", "evaded"),
    [
        ("controller: pure_pursuit", True),
        ("evasion: {when: never}", False),
        ("controller: mppi", False),  # plans with tracks itself
    ],
)
def test_who_walks_is_no_obstacle_where_only_evasion_keeps_clear_of_them(
    mission, navigation, evaded
):
    file = mission()
    before = "controller: {use: mppi, moving_weight: 150.0}"
    text = file.read_text("utf-8")
    assert before in text
    file.write_text(text.replace(before, navigation), "utf-8")
    plan = prepare(file, RunOptions(serve=False))
    engine = build(
        plan, RunOptions(serve=False), Telemetry(run_info(plan, "x", 0), [], print), None
    )
    runtime, world_model = engine.runtime, engine.runtime.parts.perceiver.world_model
    lethal = []
    for _ in range(100):  # 5 s at 20 Hz: they meet in the middle of the hall
        runtime.step()
        pose, costs = (
            runtime.parts.perceiver.estimator.estimate.pose,
            world_model.local_costmap.grid,
        )
        for track in runtime.perceived.world.tracks:
            if pose.distance_to(Pose2D(*track.position)) > 2.5:
                continue  # outside the window of 6 by 6 m, or at its edge
            row, column = costs.cell_at(*track.position)
            around = costs.cells[row - 6 : row + 7, column - 6 : column + 7]  # 0.3 m to each side
            lethal.append(bool(around.max() == LETHAL_COST))
    engine.body.close()
    assert len(lethal) >= 10
    assert sum(lethal) <= 2 if evaded else sum(lethal) > 0.5 * len(lethal)
