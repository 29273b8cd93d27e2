"""Tolerances that are finer than a robot can meet are found before it drives."""

import pytest

from missions.execution.prepare import RunOptions, diagnose
from tests.missions.execution.live_run import HEAD


def found(tmp_path, run, settings="", robot=None, code="W148"):
    path = tmp_path / "m.yaml"
    head = HEAD + (f"navigation: {{{settings}}}\n" if settings else "")
    path.write_text(f"{head}run: {run}\n", "utf-8")
    findings = diagnose(path, RunOptions(robot=robot)).findings
    return [(item.code, item.sentence) for item in findings if item.code == code]


@pytest.mark.parametrize(
    ("tolerance", "count"), [("2 mm", 1), ("5.4 mm", 1), ("6 mm", 0), ("1 cm", 0)]
)
def test_a_position_tolerance_below_one_step_and_the_pose(tmp_path, tolerance, count):
    """0.05 m/s for one period of 50 ms, and 0.3 of the lidar's noise of 1 cm: 5.5 mm."""
    run = f"{{navigate_to_pose: {{goal: [2, 1], tolerance: {tolerance}}}}}"
    assert len(found(tmp_path, run)) == count


def test_the_goal_checker_of_a_mission(tmp_path):
    """0.08 rad/s for 50 ms are 0.23 degrees."""
    run = "{navigate_to_pose: [2, 1]}"
    settings = "goal_checker: {position: 1 mm, heading: 0.1 deg}"
    assert found(tmp_path, run, settings) == [
        ("W148", "goal_checker.position: 1 mm is finer than scout can be expected to meet, 5.5 mm"),
        ("W148", "goal_checker.heading: 0.1 deg is finer than scout can be expected to meet, "
         "0.23 deg"),
    ]  # fmt: skip
    assert not found(tmp_path, run, "goal_checker: {position: 1 cm, heading: 0.5 deg}")
    assert not found(tmp_path, run, "goal_checker: {use: simple_goal, position: 1 cm}")


def test_a_car_cannot_correct_beside_its_path(tmp_path):
    run = "{navigate_to_pose: {goal: [2, 1], tolerance: 1 cm}}"
    assert not found(tmp_path, run)
    assert [sentence for _, sentence in found(tmp_path, run, robot="buggy")] == [
        "tolerance: 10 mm is finer than buggy can be expected to meet, 30 mm"
    ]


def test_an_accepted_tolerance_is_coarser_than_the_other(tmp_path):
    run = "{navigate_to_pose: {goal: [2, 1], tolerance: 5 cm, accept: ACCEPT}}"
    assert not found(tmp_path, run.replace("ACCEPT", "6 cm"), code="W149")
    assert found(tmp_path, run.replace("ACCEPT", "5 cm"), code="W149") == [
        ("W149", "accept: 50 mm is no coarser than the tolerance, 50 mm")
    ]
