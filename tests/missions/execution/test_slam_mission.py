"""A mission with `localisation: slam`: pose, growing map, costmap."""

import numpy as np

from stack.types import UNKNOWN
from tests.missions.execution.live_run import LiveRun

HEAD = """mission: m
robot: scout
world: small_room
map: none
start: [1.5, 2.0, 0]
localisation: {use: slam, map_period: 0.5}
"""
TURN = "run: {spin: {angle: 180 deg}}\n"


def test_the_map_grows_while_the_robot_turns_and_planners_see_it(tmp_path):
    run = LiveRun(tmp_path, TURN, head=HEAD)
    run.steps(200)
    parts = run.runtime.parts
    try:
        truth = parts.scorer.truth
        assert parts.estimator.estimate.pose.distance_to(truth) < 0.03
        assert parts.estimator.estimate.health > 0.8
        assert len(parts.estimator.mapper.graph.keyframes) >= 3  # of one place no more are kept
        shown = parts.map_layer.content
        known = np.count_nonzero(shown.cells != UNKNOWN) * shown.resolution**2
        assert known > 10.0  # square metres
        row, column = parts.world_model.global_costmap.grid.cell_at(1.5, 2.0)
        assert parts.world_model.global_costmap.grid.cells[row, column] < 253
    finally:
        parts.estimator.close()
