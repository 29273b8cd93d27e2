"""The behaviours that ask the robot for one task and follow it."""

import pytest
from py_trees.common import Status

from behaviours.motion.assisted_teleop import AssistedTeleop
from behaviours.motion.back_up import BackUp
from behaviours.motion.drive_for import DriveFor
from behaviours.motion.drive_on_heading import DriveOnHeading
from behaviours.motion.free_space_escape import FreeSpaceEscape
from behaviours.motion.spin import Spin
from behaviours.navigation.navigate_through import NavigateThrough
from behaviours.navigation.navigate_to_pose import NavigateToPose
from behaviours.testing import ScriptedRobot, halt, tick
from stack.errors import NavigationError
from stack.types import STANDSTILL, FailureCode, Pose2D, TaskStatus, Twist


@pytest.fixture
def robot():
    return ScriptedRobot()


TASKS = [
    (
        NavigateToPose(goal=Pose2D(4.0, 1.5)),
        ("navigate_to", {"goal": Pose2D(4.0, 1.5), "tolerance": None, "partial": False}),
    ),
    (
        NavigateThrough(goals=[Pose2D(1.0, 0.0), Pose2D(2.0, 0.0)], tolerance=0.1),
        ("navigate_through", {"goals": [Pose2D(1.0, 0.0), Pose2D(2.0, 0.0)], "tolerance": 0.1}),
    ),
    (Spin(angle=1.5), ("spin", {"angle": 1.5, "speed": None})),
    (BackUp(distance=0.3, speed=0.15), ("back_up", {"distance": 0.3, "speed": 0.15})),
    (
        FreeSpaceEscape(clearance=0.2),
        ("escape", {"clearance": 0.2, "distance": 1.5, "speed": None}),
    ),
    (
        DriveOnHeading(distance=-1.0, direction=0.5),
        ("drive_on_heading", {"distance": -1.0, "speed": None, "direction": 0.5}),
    ),
]


@pytest.mark.parametrize(("behaviour", "call"), TASKS, ids=lambda item: getattr(item, "name", ""))
class TestTasks:
    def test_asks_once_and_shows_how_far_it_is(self, behaviour, call, robot):
        tick(behaviour, robot)
        robot.task.feedback = "3.0 m to go"
        assert tick(behaviour, robot, 1.0) is Status.RUNNING
        assert robot.calls == [call]
        assert behaviour.feedback_message == "3.0 m to go"
        halt(behaviour)

    def test_succeeds_with_the_task(self, behaviour, call, robot):
        tick(behaviour, robot)
        robot.task.succeed()
        assert tick(behaviour, robot) is Status.SUCCESS

    def test_passes_on_why_it_failed(self, behaviour, call, robot):
        tick(behaviour, robot)
        robot.task.fail(FailureCode.NO_PROGRESS, "stood still for 10 s")
        assert tick(behaviour, robot) is Status.FAILURE
        assert (behaviour.failure.code, behaviour.failure.sentence) == (
            "NO_PROGRESS",
            "stood still for 10 s",
        )

    def test_pre_emption_stops_the_robot(self, behaviour, call, robot):
        tick(behaviour, robot)
        halt(behaviour)
        assert robot.task.status is TaskStatus.CANCELLED

    def test_a_later_task_of_somebody_else_is_left_alone(self, behaviour, call, robot):
        tick(behaviour, robot)
        robot.task.succeed()
        tick(behaviour, robot)
        other = robot.spin(1.0)
        halt(behaviour)
        assert other.status is TaskStatus.RUNNING

    def test_moves_the_robot(self, behaviour, call, robot):
        assert behaviour.claims == ("base",)


def test_measures_the_way_and_the_time(robot):
    drive = NavigateToPose(goal=Pose2D(3.0, 4.0))
    written = []
    drive.bind_output("path_length", written.append)
    tick(drive, robot)
    for robot.odometry in (Pose2D(3.0, 0.0), Pose2D(3.0, 4.0)):
        robot.advance(5.0)
        tick(drive, robot)
    robot.task.succeed()
    tick(drive, robot)
    assert written == [7.0]  # 3 m east, then 4 m north
    assert drive.time_taken == 10.0


def test_a_goal_given_by_key_is_read_when_the_drive_begins(robot):
    drive = NavigateToPose(goal=None)
    drive.bind_input("goal", lambda: Pose2D(9.0, 9.0))
    tick(drive, robot)
    assert robot.calls_of("navigate_to")[0]["goal"] == Pose2D(9.0, 9.0)


def test_no_goals_is_a_failure_with_a_sentence(robot):
    assert tick(drive := NavigateThrough(goals=[]), robot) is Status.FAILURE
    assert "empty list" in drive.failure.sentence
    assert robot.calls == []


def test_drives_for_a_time_and_stands(robot):
    drive = DriveFor(time=1.0, linear=0.2, angular=0.1)
    assert tick(drive, robot, 0.9) is Status.RUNNING
    assert robot.twist == Twist(0.2, 0.1)
    assert all(call["seconds"] <= 0.3 for call in robot.calls_of("drive_for"))
    # What is left at 0.9 s: nothing may go on driving after the second is over.
    assert robot.calls_of("drive_for")[-1]["seconds"] == pytest.approx(0.1)
    robot.advance(0.1)
    assert tick(drive, robot) is Status.SUCCESS
    assert robot.twist == STANDSTILL


def test_drive_for_stands_still_when_pre_empted_but_only_then(robot):
    drive = DriveFor(time=1.0, linear=0.2)
    tick(drive, robot)
    halt(drive)
    assert robot.twist == STANDSTILL
    other = robot.spin(1.0)
    halt(drive)
    assert other.status is TaskStatus.RUNNING


def test_a_partial_drive_outputs_the_distance_left(robot):
    behaviour = NavigateToPose(goal=Pose2D(4.0, 3.0), partial=True)
    tick(behaviour, robot)
    assert robot.calls[0][1]["partial"] is True
    robot.task.succeed()
    robot.pose = Pose2D(1.0, -1.0)
    assert tick(behaviour, robot) is Status.SUCCESS
    assert behaviour.remaining == pytest.approx(5.0)  # 3, 4, 5


class TestAssistedTeleop:
    def test_hands_over_and_says_so(self, robot):
        behaviour = AssistedTeleop(time=20.0, silence=5.0)
        assert tick(behaviour, robot, 3.0) is Status.RUNNING
        assert robot.calls_of("assisted_teleop") == [{"seconds": 20.0, "silence": 5.0}]
        assert robot.said == ["the operator may drive: arrow keys, enter when done"]
        robot.task.succeed()
        assert tick(behaviour, robot) is Status.SUCCESS
        assert behaviour.claims == ("base",)

    @pytest.mark.parametrize(
        ("code", "time_over", "status"),
        [
            ("TIMED_OUT", "failure", Status.FAILURE),
            ("TIMED_OUT", "success", Status.SUCCESS),
            ("NO_PROGRESS", "success", Status.FAILURE),
        ],
    )
    def test_what_it_is_when_the_time_is_over_is_the_missions_choice(
        self, robot, code, time_over, status
    ):
        behaviour = AssistedTeleop(time_over=time_over)
        tick(behaviour, robot)
        robot.task.fail(code, "the operator was not done after 120 s")
        assert tick(behaviour, robot) is status
        assert (behaviour.failure is None) == (status is Status.SUCCESS)

    def test_pre_emption_takes_the_wheels_back(self, robot):
        behaviour = AssistedTeleop()
        tick(behaviour, robot)
        halt(behaviour)
        assert robot.task.status is TaskStatus.CANCELLED


def test_a_lost_robot_refuses_velocities_of_behaviours():
    robot = ScriptedRobot(health=0.1)
    with pytest.raises(NavigationError, match="LOST"):
        tick(DriveFor(time=1.0, linear=0.2), robot)
    robot.drive_for(STANDSTILL, 0.3)  # it can be stopped
    assert robot.spin(1.0).failure.code == FailureCode.LOST
    assert robot.spin(1.0, while_lost=True).failure is None


FINE = {"tolerance": 0.02, "accept": 0.1, "accept_after": 5.0}


def coarse_drives(robot):
    return [call for call in robot.calls if call[1]["tolerance"] == 0.1]


def test_a_coarser_tolerance_is_accepted_after_a_while_within_it(robot):
    behaviour = NavigateToPose(goal=Pose2D(4.0, 1.5), **FINE)
    tick(behaviour, robot)
    robot.pose = Pose2D(3.95, 1.5)
    for _ in range(4):
        assert tick(behaviour, robot, 1.0) is Status.RUNNING
        assert not coarse_drives(robot)
    robot.pose = Pose2D(3.8, 1.5)
    tick(behaviour, robot, 1.0)  # left: the time begins again
    robot.pose = Pose2D(3.95, 1.5)
    for _ in range(5):
        assert not coarse_drives(robot)
        assert tick(behaviour, robot, 1.0) is Status.RUNNING
    assert len(coarse_drives(robot)) == 1
    robot.task.succeed()
    assert tick(behaviour, robot) is Status.SUCCESS
    assert behaviour.remaining == pytest.approx(0.05)


def test_the_finer_tolerance_met_in_time_is_the_end(robot):
    behaviour = NavigateToPose(goal=Pose2D(4.0, 1.5), **FINE)
    tick(behaviour, robot)
    robot.pose = Pose2D(3.99, 1.5)
    robot.task.succeed()
    assert tick(behaviour, robot, 9.0) is Status.SUCCESS
    assert not coarse_drives(robot)


@pytest.mark.parametrize(
    ("x", "code", "again"),
    [
        (3.95, FailureCode.NO_PROGRESS, True),
        (3.0, FailureCode.NO_PROGRESS, False),
        (1.0, FailureCode.GOAL_OCCUPIED, True),  # the nearest free pose may be near enough
    ],
)
def test_a_drive_that_fails_where_the_coarser_tolerance_is_enough_goes_on(robot, x, code, again):
    behaviour = NavigateToPose(goal=Pose2D(4.0, 1.5), **FINE)
    tick(behaviour, robot)
    robot.pose = Pose2D(x, 1.5)
    robot.task.fail(code, "it does not get there")
    assert tick(behaviour, robot) is (Status.RUNNING if again else Status.FAILURE)
    assert len(coarse_drives(robot)) == int(again)
    if again:
        robot.task.fail(code, "nor there")
        assert tick(behaviour, robot) is Status.FAILURE
        assert len(coarse_drives(robot)) == 1
