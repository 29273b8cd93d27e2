"""Layers and safety zones as a mission names them: read, checked at their place, driven."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from missions.execution.build import build, run_info
from missions.execution.prepare import RunOptions, prepare
from missions.execution.runner import run_mission
from stack.errors import InputError
from stack.mapping.ros_map import write_ros_map
from stack.telemetry.hub import Telemetry
from stack.types import FREE, OCCUPIED, OccupancyGrid
from tests.benchmarks.missions import Trace

HEAD = """mission: site rules
format: 1
robot: scout
world: office
start: dock
navigation:
  costmap:
    layers:
      - static
      - obstacle
"""
RULES = """      - use: keepout
        zones: [{name: stairs, corners: [[6, 4.3], [7, 4.3], [7, 5.2], [6, 5.2]]}]
      - {use: keepout, name: painted, mask: house/keepout.yaml}
      - {use: preferred_lanes, only: global, zones: [[[0, 3.8], [14, 3.8], [14, 6], [0, 6]]]}
      - social
  speed_limits:
    zones: [{corners: [[2, 3], [4, 3], [4, 7], [2, 7]], speed: 0.25 m/s}]
  safety:
    zones:
      - {name: near, action: slow_down, radius: 0.5, ratio: 70 %}
"""
RUN = """run:
  navigate_to_pose: {goal: [9.5, 4.8, 0]}
  timeout: 60 s
"""


def wired(plan):
    telemetry = Telemetry(run_info(plan, "test", 0), [], lambda text: None)
    return build(plan, RunOptions(serve=False), telemetry, None)


@pytest.fixture
def mission(tmp_path):
    (tmp_path / "house").mkdir()
    cells = np.full((20, 20), FREE, dtype=np.int8)
    cells[5:10, 5:10] = OCCUPIED
    write_ros_map(OccupancyGrid(cells, 0.1, (7.5, 4.0)), tmp_path / "house" / "keepout.yaml")
    path = tmp_path / "rules.yaml"

    def write(rules=RULES):
        path.write_text(HEAD + rules + RUN, "utf-8")
        return path

    return write


def test_each_costmap_gets_the_layers_that_are_meant_for_it(mission):
    plan = prepare(mission(), RunOptions(serve=False))
    engine = wired(plan)
    try:
        parts = engine.runtime.parts
        lanes = "preferred_lanes"
        assert lanes in parts.global_costmap.layers and lanes not in parts.local_costmap.layers
        assert parts.global_costmap.explain(6.5, 4.8).source == "stairs"
        assert parts.global_costmap.explain(8.25, 4.75).layer == "painted"
        assert parts.tracker is not None
    finally:
        engine.body.close()


def test_without_the_social_layer_nobody_follows_people():
    plan = prepare("01_drive_to_a_point", RunOptions(serve=False))
    engine = wired(plan)
    assert engine.runtime.parts.tracker is None
    assert engine.runtime.parts.local_costmap.layers == ("static", "obstacle")
    engine.body.close()


@pytest.mark.parametrize(
    ("rules", "where", "words"),
    [
        (
            "      - obstacles\n",
            "rules.yaml:9:7",
            "layer 3: there is no costmap layer 'obstacles'; did you mean 'obstacle'",
        ),
        ("      - {use: social, horizont: 1 s}\n", "rules.yaml:9:7", "no parameter 'horizont'"),
        ("  safety:\n    zones: [{action: halt}]\n", "rules.yaml:12:12", "'halt' is not one of"),
        ("      - {use: keepout, mask: nowhere.yaml}\n", "", "nowhere.yaml does not exist"),
    ],
)
def test_what_is_wrong_is_found_before_anything_moves(mission, rules, where, words):
    with pytest.raises(InputError) as raised:
        prepare(mission(rules), RunOptions())
    assert where in str(raised.value) and words in str(raised.value)


@pytest.mark.slow
def test_a_mission_keeps_to_the_rules_of_its_house(mission):
    trace = Trace()
    report = run_mission(mission(), RunOptions(seed=1, serve=False), [trace])
    assert (report.status, report.reason, report.collisions) == ("success", "", 0)
    assert report.simulated_seconds > 2.0 / 0.25  # two metres of the way at 0.25 m/s at most
    for pose in trace.truths:
        assert not (6.0 < pose.x < 7.0 and 4.3 < pose.y < 5.2)
        assert not (8.0 < pose.x < 8.5 and 4.5 < pose.y < 5.0)
    steps = [
        one.distance_to(other)
        for one, other in pairwise(trace.truths)
        if all(2.1 < pose.x < 3.9 for pose in (one, other))
    ]
    assert len(steps) > 50
    assert max(steps) < 0.25 * 0.15 * 1.05  # two or three steps of the loop apart
