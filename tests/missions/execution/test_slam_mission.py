"""A mission with `localisation: slam`: pose, growing map, costmap; an optimiser that fails."""

import numpy as np
import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from missions.execution.running import run_in_turns
from stack.child_process import Worker
from stack.mapping.slam.worker import NAME
from stack.patience import Patience
from stack.types import UNKNOWN
from tests.missions.execution.live_run import LiveRun

HEAD = """mission: m
robot: scout
world: small_room
map: none
start: [1.5, 2.0, 0]
localisation: slam
"""
TURN = "run: {spin: {angle: 180 deg}}\n"


def test_the_map_grows_while_the_robot_turns_and_planners_see_it(tmp_path):
    run = LiveRun(tmp_path, TURN, head=HEAD)
    run.steps(200)
    parts = run.runtime.parts
    try:
        truth = parts.scorer.truth
        assert parts.perceiver.estimator.estimate.pose.distance_to(truth) < 0.03
        assert parts.perceiver.estimator.estimate.health > 0.8
        keyframes = parts.perceiver.estimator.mapper.graph.keyframes
        assert len(keyframes) >= 3  # of one place no more are kept
        shown = parts.perceiver.map_layer.content
        known = np.count_nonzero(shown.cells != UNKNOWN) * shown.resolution**2
        assert known > 10.0  # square metres
        row, column = parts.perceiver.world_model.global_costmap.grid.cell_at(1.5, 2.0)
        assert parts.perceiver.world_model.global_costmap.grid.cells[row, column] < 253
    finally:
        parts.perceiver.estimator.close()


FAULTS = {
    "raises": ("failing", 0, "failed: ZeroDivisionError: division by zero"),
    "ends": ("exiting", 9, "ended with exit code 9"),
    "is suspended": ("suspending", 0, "gave no answer for 0.2 s"),
}


@pytest.mark.parametrize(("target", "request_", "reason"), FAULTS.values(), ids=FAULTS)
def test_a_mission_whose_optimiser_fails_ends_at_once_with_the_cause(
    tmp_path, monkeypatch, target, request_, reason
):
    monkeypatch.setattr(Patience, "LONGEST", 0.2 if target == "suspending" else 30.0)
    mission = tmp_path / "m.yaml"
    mission.write_text(HEAD + TURN)
    options = RunOptions(serve=False, out=tmp_path / "out")
    run = Run(prepare(mission, options), options)
    try:
        worker = run.engine.runtime.parts.perceiver.estimator._worker
        worker._worker = Worker(NAME, f"tests.stack.worker_targets:{target}")
        worker.submit(request_, due=0.5)
        run_in_turns([run])
    finally:
        run.close()
    assert run.report.status == "error"
    assert run.report.reason.startswith(f"{NAME} {reason}")
    assert run.report.simulated_seconds == 0.5  # when the result was due
    assert (tmp_path / "out" / "report.json").exists()
