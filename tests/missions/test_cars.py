"""A car turns on the spot of a small room by driving to and fro, as its plan says."""

from __future__ import annotations

from math import pi

import pytest

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from stack.types import Pose2D, wrap_angle
from tests.benchmarks.missions import Trace

WORLD = """world: small room
format: 1
bounds: [-0.5, -0.5, 3.5, 3.1]
start: [1.5, 1.3, 0]
walls:
  - {points: [[0, 0], [3, 0], [3, 2.6], [0, 2.6]], closed: true}
"""
MISSION = """mission: turn
format: 1
robot: buggy
world: ./world.yaml
start: [1.5, 1.3, 0]
navigation: {{controller: {controller}}}
run:
  sequence:
    - navigate_to_pose: {{goal: [1.5, 1.3, 40 deg]}}
      timeout: 30 s
    - navigate_to_pose: {{goal: [1.5, 1.3, 130 deg]}}
      timeout: 30 s
"""


@pytest.mark.slow
@pytest.mark.parametrize(("controller", "plans"), [("pure_pursuit", 2), ("dwb", 2), ("mppi", 4)])
def test_a_car_turns_to_its_goal_by_the_first_plan(tmp_path, controller, plans):
    """mppi may correct each turn once: it does not follow its path to the millimetre."""
    (tmp_path / "world.yaml").write_text(WORLD, "utf-8")
    file = tmp_path / "mission.yaml"
    file.write_text(MISSION.format(controller=controller), "utf-8")
    trace = Trace()
    report = run_mission(str(file), RunOptions(serve=False), [trace])
    assert report.status == "success", report
    events = [event for event in trace.events if event.kind in {"plan", "replan"}]
    assert len(events) <= plans, [event.text for event in events]
    end = trace.truths[-1]
    assert abs(wrap_angle(end.heading - 130.0 * pi / 180.0)) < 0.15
    assert end.distance_to(Pose2D(1.5, 1.3)) < 0.1
