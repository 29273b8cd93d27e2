"""follow_person, wait_for_door, detect_markers and inspect with sensors of the simulation."""

from __future__ import annotations

import json
from math import pi

import pytest

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission

HALL = """world: hall
format: 1
bounds: [-0.5, -0.5, 9.5, 6.5]
start: [2, 3, 0]
walls:
  - {{points: [[0, 0], [9, 0], [9, 6], [0, 6]], closed: true}}
{more}
"""
MISSION = """mission: watch
format: 1
robot: scout
world: hall.yaml
blackboard:
  gap: {{type: float, initial: 0.0}}
  waited: {{type: float, initial: 0.0}}
  ids: {{type: list of int, optional: true}}
  poses: {{type: list of Pose, optional: true}}
  photo: {{type: text, optional: true}}
run:
{run}
"""


@pytest.fixture
def watch(tmp_path):
    def run(more, steps, **options):
        (tmp_path / "hall.yaml").write_text(HALL.format(more=more), "utf-8")
        path = tmp_path / "watch.yaml"
        path.write_text(MISSION.format(run=steps), "utf-8")
        return run_mission(path, RunOptions(seed=1, serve=False, **options))

    return run


@pytest.mark.parametrize(
    ("speed", "y"),
    [(0.5, 3.0), (0.6, 2.9), (0.6, 3.0), (0.6, 3.1), (0.7, 3.0)],
)
def test_it_leaves_the_way_of_a_person_who_comes_back_and_stops_for_nobody(watch, speed, y):
    waypoints = f"[[6, {y}], [8, {y}], [0.6, {y}]]"
    report = watch(
        f"people: [{{name: Ada, waypoints: {waypoints}, speed: {speed}, yields: false}}]",
        "  follow_person: {until_time: 14 s}\n  out: {gap: $gap}",
    )
    assert (report.status, report.reason) == ("success", "")
    people = report.people
    assert people["contacts"] == [] and people["least_distance"] > 0.1
    # At 0.6 m/s Ada passes the place where the robot began, x = 2, after (2 + 6) / 0.6 = 13.3 s.
    assert people["seconds_personal"] > 1.0


def test_it_waits_for_a_door_that_opens(watch):
    door = (
        "  - {points: [[5, 0], [5, 2.5]]}\n  - {points: [[5, 3.5], [5, 6]]}\n"
        "doors: [{name: slide, from: [5, 2.5], to: [5, 3.5], closed: true}]\n"
        "timeline: [{when: {time: 9 s}, open_door: slide}]"
    )
    report = watch(
        door,
        "  sequence:\n"
        "    - wait_for_door: {door: [5, 3, 0 deg], width: 1 m, distance: 1 m}\n"
        "      out: {waited: $waited}\n"
        "    - navigate_to_pose: {goal: [7, 3, 0 deg]}",
    )
    assert (report.status, report.collisions) == ("success", 0)
    # It arrives 1 m before the door (1.8 m of way) before 6 s and goes on from 10 s on.
    assert 3.0 < float(report.blackboard["waited"]) < 8.0
    assert report.simulated_seconds > 10.0


def test_it_measures_markers_and_saves_a_picture_with_its_pose(watch, tmp_path):
    marker = "markers: [{id: 3, at: [4, 5.95], height: 0.4, facing: -90 deg}]"
    report = watch(
        marker,
        "  sequence:\n"
        "    - detect_markers: {turn: 200 deg, wanted: [3]}\n"
        "      out: {ids: $ids, poses: $poses}\n"
        "    - inspect: {label: the wall, min_sharpness: 0.5}\n"
        "      out: {image: $photo}",
        out=tmp_path / "run",
    )
    assert (report.status, report.reason) == ("success", "")
    assert json.loads(report.blackboard["ids"]) == [3]
    picture = tmp_path / "run" / report.blackboard["photo"]
    assert picture.read_bytes()[:2] == b"\xff\xd8"  # JPEG
    details = json.loads(picture.with_suffix(".json").read_text("utf-8"))
    assert details["picture"] == report.blackboard["photo"]
    assert details["pose"]["x"] == pytest.approx(2.0, abs=0.05)
    assert 0.5 < details["pose"]["heading"] < 0.5 * pi
    assert details["sharpness"] >= 0.5
