"""People who walk through a hall: MPPI asks for tracks of them and keeps its distance."""

from __future__ import annotations

import pytest

from missions.execution.build import build, run_info
from missions.execution.prepare import RunOptions, prepare
from missions.execution.running import run_mission
from stack.errors import InputError
from stack.telemetry.hub import Telemetry

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
    tracker = engine.runtime.parts.world_model.tracker
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
