"""A mission whose robot is lost: no recovery moves it, and each of them says why."""

from __future__ import annotations

import pytest

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from tests.benchmarks.missions import Trace

MISSION = """mission: lost
format: 1
robot: scout
world: small_room
start: home
initial_pose: [4.0, 2.0, 90 deg]          # wrong: 1.3 m and 90 degrees off
localisation: {use: mcl, recover: false}  # and it stays so
plugins: [./plugins]
run:
  navigate_to_pose: {goal: $plant}
  recover:
    attempts: 7
    round_robin:
      - sway
      - spin: {angle: 90 deg}
      - back_up: {distance: 30 cm}
      - drive_on_heading: {distance: 30 cm}
      - free_space_escape
      - wall_follow: {until_travelled: 1 m}
"""

SWAY = '''
from py_trees.common import Status

from behaviours.base import RobotBehaviour
from stack.types import Twist


class Sway(RobotBehaviour):
    """Drive back for a second, by its own control loop."""

    claims = ("base",)

    def initialise(self):
        self._timer = self.start_timer()

    def update(self):
        self.robot.base.drive_for(Twist(-0.2), 0.3)
        return Status.SUCCESS if self._timer.is_over(1.0) else Status.RUNNING
'''


@pytest.fixture(scope="module")
def lost(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lost")
    (folder / "plugins").mkdir()
    (folder / "plugins" / "sway.py").write_text(SWAY)
    (folder / "lost.yaml").write_text(MISSION)
    display = Display()
    report = run_mission(folder / "lost.yaml", RunOptions(serve=False), [display])
    return report, display


class Display(Trace):
    """Also keeps the line below the vitals of the dashboard."""

    def __init__(self):
        super().__init__()
        self.lines: set[str] = set()

    def snapshot(self, snapshot):
        super().snapshot(snapshot)
        self.lines.add(snapshot.safety)


def test_no_recovery_moves_a_lost_robot(lost):
    report, _ = lost
    assert report.status == "failure" and "LOST localisation health" in report.reason
    assert report.distance_m < 0.01


def test_each_recovery_fails_with_the_reason(lost):
    """Also a behaviour of a plugin with its own control loop."""
    _, display = lost
    changes = [event.fields for event in display.events if event.kind == "node_status"]
    failed = [change for change in changes if change["to"] == "failure"]
    names = "sway", "spin", "back_up", "drive_on_heading", "free_space_escape", "wall_follow"
    recoveries = [change for change in failed if change["name"] in names]
    assert tuple(change["name"] for change in recoveries) == names
    assert all("run `relocalise` first" in change["message"] for change in recoveries)
    assert not [event for event in display.events if event.kind == "exception"]


def test_the_doubt_is_an_event_and_a_figure_of_the_report(lost):
    report, display = lost
    (doubt,) = [event for event in display.events if event.kind == "doubt"]
    assert doubt.level == "warning"
    assert doubt.fields["doubt"] == "lost" and doubt.fields["health"] < 0.3
    assert report.doubt["lost_seconds"] > 7 * 1.5 - 1e-6  # each of 7 attempts waits lost_time
    assert report.doubt["obscured_metres"] == 0.0
    assert "stopped: lost, the scans do not fit the map" in display.lines
    assert f"lost for {report.doubt['lost_seconds']:.1f} s" in report.summary()


HALL = """world: hall
format: 1
bounds: [-0.5, -0.5, 10.5, 6.5]
start: west
places: {west: [2.5, 3, 0], east: [8, 3, 0]}
walls:
  - {points: [[0, 0], [10, 0], [10, 6], [0, 6]], closed: true}
boxes:                                    # an unmapped lane, closed at its end
  - {name: left, at: [5.8, 3.8], size: [5.6, 0.3, 0.7], on_map: false}
  - {name: right, at: [5.8, 2.2], size: [5.6, 0.3, 0.7], on_map: false}
  - {name: end, at: [8.8, 3.0], size: [0.3, 1.3, 0.7], on_map: false}
"""

THROUGH = """mission: through
format: 1
robot: scout
world: ./hall.yaml
navigation: {navigator: {obscured_distance: 1 m}}
run: {navigate_to_pose: {goal: $east}}
"""


def test_past_unmapped_things_it_drives_a_metre_by_odometry(tmp_path):
    """From 1.3 m within the lane on hardly a beam ends at a mapped wall, and none behind one."""
    (tmp_path / "hall.yaml").write_text(HALL)
    (tmp_path / "through.yaml").write_text(THROUGH)
    display = Display()
    report = run_mission(tmp_path / "through.yaml", RunOptions(serve=False), [display])
    doubts = [event.fields["doubt"] for event in display.events if event.kind == "doubt"]
    assert doubts == ["obscured", "lost"]
    assert "slower: 0.20 m/s by odometry, unmapped things hide the map" in display.lines
    assert report.doubt["obscured_metres"] == pytest.approx(1.0, abs=0.05)
    assert report.reason.endswith(
        "the scans do not fit the map here, and the distance that may be driven by odometry "
        "meanwhile is used up; run `relocalise` first"
    )
    assert "by odometry past unmapped things" in report.summary()
    error = max(error for _, error, _ in display.errors)
    assert error < 0.1, "odometry was right"
