"""Whole missions whose paths turn back, and whose goals are near and exact; judged by the truth."""

from __future__ import annotations

import pytest

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from stack.types import Pose2D
from tests.benchmarks.missions import Trace

WORLD = """world: hall
format: 1
start: [1.0, 1.2, 0 deg]
walls:
  - {points: [[0, 0], [5, 0], [5, 2.4], [0, 2.4]], closed: true}
"""
HEAD = """mission: exact
format: 1
robot: scout
world: ./world.yaml
"""


def driven(tmp_path, run):
    """Run a mission; its report and the true poses."""
    (tmp_path / "world.yaml").write_text(WORLD, "utf-8")
    file = tmp_path / "mission.yaml"
    file.write_text(f"{HEAD}{run}", "utf-8")
    trace = Trace()
    report = run_mission(str(file), RunOptions(serve=False), [trace])
    assert report.status == "success", report
    return report, trace.truths


def test_a_small_move_is_made(tmp_path):
    """3 cm, with an error of the estimate of some millimetres."""
    run = "run: {navigate_to_pose: {goal: [1.03, 1.2, 0 deg], tolerance: 1 cm}, timeout: 20 s}\n"
    _, truths = driven(tmp_path, run)
    assert truths[0].distance_to(truths[-1]) > 0.01
    assert truths[-1].distance_to(Pose2D(1.03, 1.2)) < 0.02


@pytest.mark.slow
def test_out_to_a_far_pose_and_back(tmp_path):
    run = "run: {navigate_through: [[3.8, 1.2], [2.4, 1.2, 180 deg]], timeout: 40 s}\n"
    _, truths = driven(tmp_path, run)
    assert max(pose.x for pose in truths) > 3.8 - 0.4  # via_radius
    assert truths[-1].distance_to(Pose2D(2.4, 1.2)) < 0.17


@pytest.mark.slow
def test_a_given_path_with_a_sharp_bend(tmp_path):
    run = "run: {follow_path: {path: [[1, 1.2], [3.5, 1.2], [2.2, 1.8]]}, timeout: 40 s}\n"
    report, truths = driven(tmp_path, run)
    assert min(pose.distance_to(Pose2D(3.5, 1.2)) for pose in truths) < 0.12
    assert truths[-1].distance_to(Pose2D(2.2, 1.8)) < 0.17
    assert report.distance_m == pytest.approx(2.5 + 1.43, abs=0.35)
