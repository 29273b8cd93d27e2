"""`follow_waypoints`: order of the waypoints, missed waypoints, events and outputs."""

from dataclasses import dataclass

import pytest
from py_trees.common import Status

from missions.trees import show
from stack.types import Battery, Failure, Pose2D, TaskStatus
from tests.missions.mission_fakes import Ran, ScriptedRobot, read_text


@dataclass
class DrivingRobot(ScriptedRobot):
    """Each drive takes a tick's period and 2.5 m; one that is `stuck` goes on for ever."""

    lasting: bool = True
    stuck: bool = False

    def advance(self, seconds):
        super().advance(seconds)
        drives = self.calls_of("navigate_to")
        if drives and self.motion.status is TaskStatus.RUNNING and not self.stuck:
            self.odometry = Pose2D(self.odometry.x + 2.5, 0.0)
            self.end(self.motion, drives[-1]["goal"])


@pytest.fixture
def run(tmp_path):
    return lambda text: Ran(read_text(tmp_path, text), DrivingRobot())


KEYS = """
blackboard:
  missed: {type: list of int, initial: []}
  reached: {type: int, initial: 0}
  distance: {type: length, initial: 0}
  last: {type: int, initial: 0}
"""
OUT = "out: {missed: $missed, reached: $reached, distance: $distance}"
THREE = "[[1, 0], [2, 0], [3, 0]]"


def texts(it, kind):
    return [event["text"] for event in it.events if event["kind"] == kind]


def test_the_task_is_done_at_each_waypoint_in_turn(run):
    it = run("run: {follow_waypoints: [[1, 0], [2, 0]], do: {act: look}}")
    it.ticks(3)  # each drive ends a tick after it began
    assert it.robot.log == [
        Pose2D(1.0, 0.0), "look starts", "look done", Pose2D(2.0, 0.0), "look starts", "look done",
    ]  # fmt: skip
    assert it.tree.status is Status.SUCCESS


def test_without_a_task_it_only_drives(run):
    it = run(f"run: {{follow_waypoints: {THREE}}}")
    it.ticks(4)
    assert it.robot.log == [Pose2D(1.0, 0.0), Pose2D(2.0, 0.0), Pose2D(3.0, 0.0)]
    assert texts(it, "waypoints") == ["3 of 3 reached; 7.5 m driven"]


def test_no_waypoints_succeed_at_once(run):
    it = run("run: {follow_waypoints: []}")
    it.ticks()
    assert it.tree.status is Status.SUCCESS


def test_the_outputs_begin_with_nothing_reached(run):
    keys = (
        "blackboard: {reached: {type: int, initial: 7}, missed: {type: list of int, initial: [7]}}"
    )
    it = run(f"{keys}\nrun: {{follow_waypoints: [], out: {{missed: $missed, reached: $reached}}}}")
    it.ticks()
    found = it.tree.blackboard()
    assert (found["missed"], found["reached"]) == ("[]", "0")


def test_it_stops_at_the_first_failure_and_the_reason_names_the_waypoint(run):
    it = run(f"{KEYS}\nrun: {{follow_waypoints: {THREE}, {OUT}}}")
    it.robot.answers["shut"] = (2.0,)
    it.ticks(4)
    assert it.tree.failure == Failure("NO_VALID_PATH", "no way to x = 2")
    assert it.tree.reason == (
        "test > follow_waypoints (waypoint 2 of 3) > navigate_to_pose: "
        "NO_VALID_PATH no way to x = 2"
    )
    assert it.robot.log == [Pose2D(1.0, 0.0), Pose2D(2.0, 0.0)]
    found = it.tree.blackboard()
    # two drives of 2.5 m, the second of which failed
    assert (found["missed"], found["reached"], found["distance"]) == ("[2]", "1", "5")


def test_with_continue_missed_waypoints_are_reported_and_output(run):
    it = run(
        f"{KEYS}\nrun: {{follow_waypoints: {THREE}, on_failure: continue, "
        f"do: {{act: look}}, {OUT}}}"
    )
    it.robot.answers.update(shut=(1.0,), look="sf")
    it.ticks(4)
    assert it.tree.status is Status.SUCCESS
    assert texts(it, "waypoint_missed") == [
        "waypoint 1 of 3 missed: NO_VALID_PATH no way to x = 1",
        "waypoint 3 of 3 missed: NO_WALL look found no wall",
    ]
    assert texts(it, "waypoint") == ["waypoint 2 of 3 reached"]
    assert texts(it, "failure_passed_over") == []
    assert texts(it, "waypoints") == [
        "1 of 3 reached, missed 1 (NO_VALID_PATH), 3 (NO_WALL); 7.5 m driven"
    ]
    found = it.tree.blackboard()
    assert (found["missed"], found["reached"], found["distance"]) == ("[1, 3]", "1", "7.5")


def test_the_row_shows_the_current_waypoint(run):
    it = run("run: {follow_waypoints: [$lobby, [2, 0]], on_failure: continue, do: {act: look}}")
    it.robot.answers.update(look="r", shut=(9.0,))
    it.ticks(4)
    row = next(row for row in it.tree.rows() if row.kind == "follow_waypoints")
    assert row.message == "2 of 2, [2.00, 0.00, 0 deg]; 1 missed"


def test_the_waypoint_and_its_number_can_be_read(run):
    it = run(
        f"{KEYS}\nrun: {{follow_waypoints: {THREE}, do: {{sequence: ["
        "{set: {last: $last + $waypoint_number}}, {visit: {goals: [$waypoint]}}]}}"
    )
    it.ticks(4)
    assert it.tree.blackboard()["last"] == "6"  # 1 + 2 + 3
    assert [Pose2D(3.0, 0.0)] in it.robot.log


def test_a_second_run_resets_the_outputs(run):
    it = run(f"{KEYS}\nrun: {{follow_waypoints: {THREE}, on_failure: continue, {OUT}, repeat: 2}}")
    it.robot.answers["shut"] = (1.0,)
    it.ticks(4)
    it.robot.answers["shut"] = ()
    it.ticks(4)
    assert it.tree.blackboard()["missed"] == "[]"
    assert it.tree.blackboard()["reached"] == "3"


def test_a_drive_that_takes_too_long_is_missed(run):
    it = run(
        "run: {follow_waypoints: {waypoints: [[1, 0], [2, 0]], time_limit: 300 ms}, "
        "on_failure: continue}"
    )
    assert "timeout 300 ms" in show.text(it.tree)
    it.robot.stuck = True
    it.ticks(10)
    assert texts(it, "waypoint_missed") == [
        "waypoint 1 of 2 missed: TIMED_OUT not finished after 0.3 s",
        "waypoint 2 of 2 missed: TIMED_OUT not finished after 0.3 s",
    ]


def test_after_an_event_the_current_waypoint_continues(run):
    it = run("""
        events:
          - low: {when: battery.charge < 0.2, do: {act: charge}}
        run: {follow_waypoints: [[1, 0], [2, 0]], do: {act: look}}
        """)
    it.robot.answers["look"] = "srrs"
    it.ticks(4)
    it.robot.battery = Battery(0.1)
    it.ticks()
    it.robot.battery = Battery(1.0)
    it.ticks(3)
    assert it.tree.status is Status.SUCCESS
    assert [line for line in it.robot.log if isinstance(line, Pose2D)] == [
        Pose2D(1.0, 0.0), Pose2D(2.0, 0.0),
    ]  # fmt: skip


def test_it_is_drawn_as_a_loop(run):
    it = run(f"run: {{follow_waypoints: {THREE}, do: {{act: look}}}}")
    drawn = show.text(it.tree)
    assert "· follow_waypoints" in drawn
    assert "navigate_to_pose  goal $waypoint" in drawn
    assert "driven" not in drawn


def test_the_metres_of_a_drive_that_took_too_long_or_was_interrupted_count(run):
    it = run(f"""{KEYS}
events: [{{low: {{when: battery.charge < 0.3, do: {{act: dock}}}}}}]
run:
  follow_waypoints: {{waypoints: [[1, 0], [2, 0]], time_limit: 300 ms}}
  on_failure: continue
  {OUT}
""")
    it.robot.stuck = True
    for _ in range(10):
        it.ticks()
        it.robot.odometry = Pose2D(it.robot.odometry.x + 0.5, 0.0)
        it.robot.battery = Battery(0.1 if it.robot.time == 0.2 else 1.0)
    # Two drives of 0.3 s: three periods of 0.5 m each; the first one is interrupted at 0.2 s.
    assert it.tree.blackboard()["distance"] == "3"
