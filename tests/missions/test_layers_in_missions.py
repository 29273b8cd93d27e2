"""Layers and safety zones as a mission names them: read, checked at their place, driven."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from missions.execution.build import build, run_info
from missions.execution.prepare import RunOptions, prepare
from missions.execution.running import run_mission
from stack.errors import InputError
from stack.telemetry.hub import Telemetry
from stack.types import FREE, OCCUPIED, OccupancyGrid
from tests.benchmarks.missions import Trace
from tests.stack.mapping.written_maps import write_ros_map

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
        assert (
            lanes in parts.perceiver.world_model.global_costmap.layers
            and lanes not in parts.perceiver.world_model.local_costmap.layers
        )
        assert parts.perceiver.world_model.global_costmap.explain(6.5, 4.8).source == "stairs"
        assert parts.perceiver.world_model.global_costmap.explain(8.25, 4.75).layer == "painted"
        assert parts.perceiver.world_model.tracker is not None
    finally:
        engine.body.close()


def test_by_default_no_costmap_adds_costs_around_people():
    engine = wired(prepare("01_drive_to_a_point", RunOptions(serve=False)))
    world_model = engine.runtime.parts.perceiver.world_model
    assert world_model.local_costmap.layers == ("static", "obstacle")
    assert world_model.global_costmap.layers == ("static", "obstacle")
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
        (
            "      - inflation\n",
            "rules.yaml:9:7",
            "layer 3: use: inflation is not a layer any more: every costmap inflates; remove it",
        ),
        (
            "      - {use: speed_zones, only: local, zones: [[[0, 0], [1, 0], [1, 1]]]}\n",
            "rules.yaml:9:7",
            "layer 3: use: speed_zones moved to `navigation: {speed_limits: …}`; write its zones",
        ),
        (
            "      - {use: obstacle, inflated: 1}\n",
            "rules.yaml:9:7",
            "expected true or false, got 1",
        ),
        (
            "  speed_limits: {mask: nowhere.yaml}\n",
            "",
            "speed_limits: mask file nowhere.yaml does not",
        ),
    ],
)
def test_what_is_wrong_is_found_before_anything_moves(mission, rules, where, words):
    with pytest.raises(InputError) as raised:
        prepare(mission(rules), RunOptions())
    assert where in str(raised.value) and words in str(raised.value)


def test_each_costmap_has_its_inflation(mission):
    path = mission("")
    path.write_text(
        path.read_text("utf-8").replace(
            "  costmap:\n",
            "  costmap:\n    inflation_radius: 0.25\n    local_inflation_radius: 1 m\n"
            "    local_cost_scaling: 1.0\n",
        ),
        "utf-8",
    )
    engine = wired(prepare(path, RunOptions(serve=False)))
    try:
        parts = engine.runtime.parts
        grids = (
            parts.perceiver.world_model.local_costmap.grid,
            parts.perceiver.world_model.global_costmap.grid,
        )
        local, whole = (sorted({int(c) for c in np.unique(grid.cells)} - {255}) for grid in grids)
        # The radius of the scout is 0.22 m:
        # 252 exp(-4 (0.25 - 0.22)) = 223.5 and 252 exp(-(1 - 0.22)) = 115.5 at the radius
        assert min(c for c in whole if c) == 223
        assert min(c for c in local if c) == 115
    finally:
        engine.body.close()


OLD_LAYER = """from dataclasses import dataclass

@dataclass(frozen=True)
class Settings:
    pass

class Quiet:
    Parameters = Settings
    def __init__(self, parameters, footprint): pass
    def lay_out(self, frame, shift): pass
    def paint(self, canvas): pass
"""
KEYWORD_ONLY = """from stack.costmap.layer import Layer

class Quiet(Layer):
    def __init__(self, parameters, *, footprint):
        super().__init__(parameters, footprint)
    def paint(self, canvas): pass
"""
INCOMPLETE = """from stack.costmap.layer import Layer

class Quiet(Layer):
    pass
"""


def quiet(mission, source, use):
    """A mission with a layer of its plugin `quiet.py`."""
    path = mission(f"      - {use}\n")
    (path.parent / "quiet.py").write_text(source, "utf-8")
    text = path.read_text("utf-8").replace(
        "robot: scout\n", "robot: scout\nplugins: [./quiet.py]\n"
    )
    path.write_text(text, "utf-8")
    return prepare(path, RunOptions(serve=False))


def test_a_layer_without_the_base_class_is_told_what_to_inherit(mission):
    words = "quiet.py: Quiet is not a costmap layer; inherit treepilot.CostmapLayer"
    with pytest.raises(InputError, match=words):
        quiet(mission, OLD_LAYER, "obstacle")


def test_a_class_named_by_its_module_is_checked_as_a_layer(mission):
    with pytest.raises(InputError, match=r"Astar in stack.planning.astar is not a costmap layer"):
        prepare(mission("      - {use: 'stack.planning.astar:Astar'}\n"), RunOptions())


def test_an_incomplete_layer_says_which_method_is_missing(mission):
    with pytest.raises(InputError, match="there is no costmap layer 'quiet'"):
        quiet(mission, INCOMPLETE, "quiet")  # a base class of the plugin's own layers
    with pytest.raises(InputError, match="cannot be used: it does not implement paint"):
        prepare(mission("      - {use: 'stack.costmap.layer:Layer'}\n"), RunOptions())


def test_a_layer_whose_constructor_does_not_fit_is_reported_with_its_class(mission):
    plan = quiet(mission, KEYWORD_ONLY, "quiet")
    words = r"layer 'quiet': Quiet\(parameters, footprint\) failed: .*takes 2 positional arguments"
    with pytest.raises(InputError, match=words):
        wired(plan)


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
