"""A mission with `localisation: slam`: pose, growing map, costmap; an optimiser that fails."""

import os
import signal

import numpy as np
import pytest

from stack.mapping.slam.worker import PAUSE
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


def killed(process):
    os.kill(process.pid, signal.SIGKILL)


def suspended(process):
    os.kill(process.pid, signal.SIGSTOP)


FAULTS = {
    "killed": (killed, "was killed (SIGKILL)"),
    "suspended": (suspended, "is suspended by a signal (SIGSTOP)"),
}


@pytest.mark.parametrize(("harm", "reason"), FAULTS.values(), ids=FAULTS)
def test_a_mission_goes_on_without_its_optimiser_and_starts_another(
    tmp_path, monkeypatch, harm, reason
):
    monkeypatch.setattr("stack.mapping.slam.worker.SUSPENDED", 0.2)
    run = LiveRun(tmp_path, "run: {wait: {time: 1 min}}\n", head=HEAD)
    run.steps(20)
    estimator = run.runtime.parts.perceiver.estimator
    try:
        estimator.mapper.needs_optimising = True
        run.steps(30)  # the first process has answered
        harm(estimator._worker._worker._process)
        estimator.mapper.needs_optimising = True
        run.steps(30)
        notes = [event for event in run.kept.events if event.kind == "estimator"]
        assert [note.level for note in notes] == ["warning"] and reason in notes[0].text
        assert reason in run.runtime.snapshot().localisation_fault
        run.steps(round(20 * (PAUSE + 2.0)))
        assert not run.runtime.snapshot().localisation_fault
        assert not estimator.mapper.needs_optimising
    finally:
        estimator.close()
