from math import pi

import numpy as np
import pytest

from stack.control.checkers import PoseProgressChecker, PoseProgressParameters
from stack.errors import NavigationError, ParameterError
from stack.navigation.landmarks import Landmarks
from stack.navigation.plans.turning_place import TURNING_DISTANCE
from stack.streams import stream
from stack.types import STANDSTILL, FailureCode, Path, Pose2D, TaskStatus, Twist
from tests.stack.navigation.toy_world import ToyPlanner, ToyWorld, heading_error, robot, room

DIVIDED = [*room(8, 6), (4, 0, 4, 2.2), (4, 3.8, 4, 6)]
"""Two rooms, joined by a gap 1.6 m wide at (4, 3)."""
TWO_DOORS = [*room(8, 6), (4, 0, 4, 0.6), (4, 1.8, 4, 4.2), (4, 5.4, 4, 6)]
"""Two rooms, joined by gaps 1.2 m wide at (4, 1.2) and (4, 4.8)."""


def random_pose(random, world):
    """A pose in free space, 15 cm and more from everything."""
    while True:
        world.pose = Pose2D(*random.uniform((0.3, 0.3), (7.7, 5.7)), random.uniform(-pi, pi))
        if world.clearance() > 0.15:
            return world.pose


@pytest.mark.parametrize("batch", range(5))
def test_goals_are_reached_from_anywhere_without_a_touch(make, batch):
    random = stream(batch, "starts")
    for _ in range(10):
        world = ToyWorld(DIVIDED, robot())
        goal, start = random_pose(random, world), random_pose(random, world)
        toy = make(world)
        task = toy.navigator.base.navigate_to(goal)
        assert toy.finish(task) is TaskStatus.SUCCEEDED, (start, goal, task.failure)
        assert world.pose.distance_to(goal) < 0.03
        assert heading_error(world.pose, goal) < 0.0524  # 3 degrees
        assert world.nearest > 0.0


def test_a_drive_emits_events(make):
    toy = make()
    task = toy.navigator.base.navigate_to(Pose2D(5.0, 3.0, 0.0))
    assert toy.navigator.goal == Pose2D(5.0, 3.0, 0.0)
    toy.run(0.1)
    assert task.path is None  # planning takes 0.1 s, of simulated time
    toy.run(0.1)
    assert task.path is toy.navigator.path is not None
    toy.run(2.0)
    assert task.feedback == f"{task.distance_remaining:.1f} m to go"
    assert toy.navigator.local_plan is not None
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert toy.kinds() == ["goal", "plan", "task"]
    assert toy.events[1][1] == "plan found, 4.0 m"
    assert toy.events[2][1].startswith(
        "drive to (5.00, 3.00, 0 deg) succeeded: reached the goal, 0.0"
    )
    assert (toy.navigator.goal, toy.navigator.path, toy.navigator.local_plan) == (None,) * 3
    assert toy.distance == pytest.approx(4.0, abs=0.05)


def test_the_same_drive_twice_is_the_same_to_the_last_bit(make):
    def trace():
        world = ToyWorld(DIVIDED, robot(), Pose2D(1, 1, 2.0))
        toy = make(world)
        toy.finish(toy.navigator.base.navigate_to(Pose2D(7, 1, 0)))
        return world.time, world.pose, toy.events, toy.commands

    assert trace() == trace()


def test_a_person_in_the_way_is_waited_for(make):
    world = ToyWorld(room(8, 1.2), robot(), Pose2D(1.0, 0.6))
    slow = PoseProgressChecker(PoseProgressParameters(time=60.0), world.robot)
    toy = make(world, progress=slow, patience=30.0, collision_patience=30.0)
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 0.6, 0.0))
    toy.run(2.0)
    world.circles.append((4.5, 0.6, 0.25))
    toy.run(10.0)
    assert world.twist.linear < 1e-3
    assert 3.0 < world.pose.x < 4.1
    assert task.feedback.startswith("waiting, an obstacle is in the way")
    world.circles.clear()
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert world.nearest > 0.0


def test_a_blocked_path_is_replanned(make):
    world = ToyWorld(TWO_DOORS, robot(), Pose2D(1.0, 3.8))
    toy = make(world)
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 3.8, 0.0))
    toy.run(0.5)
    assert task.path.points[:, 1].max() > 4.0  # through the upper door
    world.circles.append((4.0, 4.8, 0.5))
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert world.nearest > 0.0
    replan = next(event for event in toy.events if event[0] == "replan")
    assert replan[2]["reason"] == "the path ahead is blocked"
    assert toy.navigator.tools.replans >= 1


def test_obstacles_missing_in_the_costmaps_are_not_hit(make):
    world = ToyWorld(room(8, 6), robot(), Pose2D(1.0, 3.0))
    toy = make(world)
    toy.follow_changes = False
    world.circles.append((4.0, 3.0, 0.3))
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 3.0, 0.0))
    assert toy.finish(task) is TaskStatus.FAILED
    assert task.failure.code in (FailureCode.NO_PROGRESS, FailureCode.COLLISION_AHEAD)
    assert world.nearest > 0.0


def test_a_slightly_better_path_is_not_worth_a_change(make):
    toy = make()
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 5.0, 0.0))
    toy.finish(task)
    assert toy.planner.calls >= 4  # one every 2 s
    assert toy.kinds().count("replan") == 0


def test_a_clearly_better_path_is_taken(make):
    world = ToyWorld(TWO_DOORS, robot(), Pose2D(1.0, 4.2, 0.0), circles=[(4.0, 4.8, 0.5)])
    toy = make(world)
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 4.8, 0.0))
    toy.run(1.0)
    assert task.path.points[:, 1].min() < 2.0  # through the lower door
    world.circles.clear()
    toy.finish(task)
    assert any(fields.get("reason") == "a better path" for _, _, fields in toy.events)
    assert task.path.points[:, 1].min() > 2.0


def test_goals_left_behind_are_not_gone_back_to(make):
    world = ToyWorld(room(8, 6), robot(), Pose2D(1.0, 3.0))
    toy = make(world)
    task = toy.navigator.base.navigate_through([Pose2D(3.0, 3.0), Pose2D(7.0, 3.0)])
    toy.run(4.0)
    assert world.pose.x > 3.0
    world.circles.append((5.5, 3.0, 0.3))
    trace = []
    while task.running:
        toy.step()
        trace.append(world.pose.x)
    assert task.status is TaskStatus.SUCCEEDED
    assert np.diff(trace).min() > -0.02


def test_a_given_path_is_followed_as_it_is(make):
    toy = make()
    x = np.arange(1.0, 6.0, 0.05)
    points = np.column_stack([x, 3.0 + 0.5 * np.sin(2 * (x - 1.0)), np.zeros_like(x)])
    task = toy.navigator.base.follow_path(Path(points))
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert toy.planner.calls == 0
    assert toy.world.pose.distance_to(task.path.goal) < 0.05
    with pytest.raises(ParameterError, match="expected at least 2 points, got 1"):
        toy.navigator.base.follow_path(Path(points[:1]))


def test_plan_answers_without_driving(make):
    toy = make()
    there = toy.navigator.base.plan(Pose2D(5.0, 3.0))
    elsewhere = toy.navigator.base.plan(Pose2D(5.0, 3.0), Pose2D(5.0, 5.0))
    outside = toy.navigator.base.plan(Pose2D(50.0, 3.0))
    toy.run(0.5)
    assert there.status is elsewhere.status is TaskStatus.SUCCEEDED
    assert there.path.length == pytest.approx(4.0, abs=0.1)
    assert elsewhere.path.length == pytest.approx(2.0, abs=0.1)
    assert outside.failure.code == FailureCode.GOAL_OUTSIDE_MAP
    assert toy.commands == [STANDSTILL] * 10


def test_planning_does_not_disturb_a_drive(make):
    toy = make()
    drive = toy.navigator.base.navigate_to(Pose2D(5.0, 3.0))
    toy.run(1.0)
    toy.navigator.base.plan(Pose2D(2.0, 2.0))
    assert toy.finish(drive) is TaskStatus.SUCCEEDED
    ends = [fields for kind, _, fields in toy.events if kind == "task"]
    assert [(end["status"], end["moves"]) for end in ends] == [
        ("succeeded", False), ("succeeded", True),
    ]  # fmt: skip


def failing(code):
    planner = ToyPlanner()
    planner.fails = NavigationError(code, "as the test wants")
    return planner


@pytest.mark.parametrize(
    ("code", "seconds"),
    [
        (FailureCode.NO_VALID_PATH, 2.0), (FailureCode.START_OCCUPIED, 2.0),
        (FailureCode.GOAL_OCCUPIED, 2.0), (FailureCode.START_OUTSIDE_MAP, 0.0),
        (FailureCode.GOAL_OUTSIDE_MAP, 0.0),
    ],
)  # fmt: skip
def test_planning_failures_end_the_drive_when_patience_is_over(make, code, seconds):
    toy = make(planner=failing(code))
    task = toy.navigator.base.navigate_to(Pose2D(5.0, 3.0))
    toy.finish(task)
    assert (task.status, task.failure.code) == (TaskStatus.FAILED, code)
    assert toy.world.time == pytest.approx(seconds + 0.15, abs=0.1)  # + the planning latency
    assert set(toy.commands) == {STANDSTILL}


@pytest.mark.parametrize("call", ["navigate_to", "plan"])
def test_the_failure_of_a_plan_names_places(make, call):
    planner = ToyPlanner()
    occupied = "goal (5.00, 3.00) is in an occupied cell"
    planner.fails = NavigationError(FailureCode.GOAL_OCCUPIED, occupied)
    toy = make(planner=planner)
    toy.navigator.tools.landmarks = Landmarks({"dock": Pose2D(5.0, 3.0)})
    task = getattr(toy.navigator.base, call)(Pose2D(5.0, 3.0))
    toy.finish(task)
    assert task.failure.sentence == "goal 'dock' (5.00, 3.00) is in an occupied cell"


def test_a_path_that_opens_in_time_is_driven(make):
    toy = make(planner=failing(FailureCode.NO_VALID_PATH))
    task = toy.navigator.base.navigate_to(Pose2D(5.0, 3.0))
    toy.run(1.5)
    toy.planner.fails = None
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def test_something_that_stays_in_the_way_fails_the_drive(make):
    world = ToyWorld(room(8, 1.2), robot(), Pose2D(1.0, 0.6))
    toy = make(world, patience=60.0)
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 0.6))
    toy.run(2.0)
    world.circles.append((4.5, 0.6, 0.25))
    toy.finish(task)
    assert task.failure.code == FailureCode.COLLISION_AHEAD
    assert world.nearest > 0.0


@pytest.mark.pain("n3090")
def test_a_cancelled_drive_leaves_the_robot_standing(make):
    toy = make()
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 3.0))
    toy.run(2.0)
    task.cancel()
    toy.run(1.5)
    assert set(toy.commands[-30:]) == {STANDSTILL}
    assert abs(toy.world.twist.linear) < 1e-3
    assert (task.status, task.failure.code) == (TaskStatus.CANCELLED, FailureCode.CANCELLED)
    task.cancel()
    assert toy.kinds().count("task") == 1


def test_a_newer_task_cancels_the_older_for_ever(make):
    toy = make()
    older = toy.navigator.base.navigate_to(Pose2D(7.0, 3.0))
    toy.run(1.0)
    newer = toy.navigator.base.navigate_to(Pose2D(2.0, 5.0))
    assert older.status is TaskStatus.CANCELLED
    assert older.failure.sentence.startswith("replaced: drive to (2.00, 5.00")
    assert toy.finish(newer) is TaskStatus.SUCCEEDED
    assert older.status is TaskStatus.CANCELLED
    toy.navigator.cancel_all()
    assert newer.status is TaskStatus.SUCCEEDED


def test_a_jump_of_the_pose_brings_a_new_path(make):
    toy = make()
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 3.0))
    toy.run(2.0)
    toy.world.pose = Pose2D(3.0, 5.0, 0.0)
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert any("m off the path" in fields.get("reason", "") for _, _, fields in toy.events)


def test_a_plugin_that_breaks_fails_the_task_not_the_loop(make):
    class Broken(ToyPlanner):
        def plan(self, costs, start, goal, options):
            return 1 / 0

    toy = make(planner=Broken())
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 3.0))
    toy.finish(task)
    assert task.failure.code == FailureCode.EXCEPTION
    assert "division by zero" in task.failure.sentence


def test_no_goals_are_refused(make):
    with pytest.raises(ParameterError, match="expected at least one pose"):
        make().navigator.base.navigate_through([])


@pytest.mark.parametrize("start", [0.0, pi], ids=["along", "against"])
def test_where_it_cannot_turn_at_the_goal_it_turns_beside_it(make, start):
    """The wall is 27 cm away, the corners of the robot are 32 cm from its middle."""
    world = ToyWorld(room(8, 6), robot(), Pose2D(4.0 - 3.0 * np.cos(start), 0.27, start))
    toy, goal = make(world), Pose2D(4.0, 0.27, pi / 2.0)
    task = toy.navigator.base.navigate_to(goal)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    reasons = [fields["reason"] for kind, _, fields in toy.events if kind == "replan"]
    assert "no room to turn at the goal" in reasons
    assert world.pose.distance_to(goal) < TURNING_DISTANCE + 0.03
    assert heading_error(world.pose, goal) < 0.0524  # 3 degrees
    assert world.nearest > 0.0


def test_a_path_that_ends_too_far_from_the_goal_is_none(make):
    class Nearby(ToyPlanner):
        def plan(self, costs, start, goal, options):
            return super().plan(costs, start, Pose2D(goal.x - 0.19, goal.y, goal.heading))

    near = make(planner=Nearby())
    assert near.finish(near.navigator.base.navigate_to(Pose2D(3.0, 3.0))) is TaskStatus.SUCCEEDED
    strict = make(planner=Nearby())
    strict.navigator.tools.landmarks = Landmarks({"dock": Pose2D(3.0, 3.0)})
    task = strict.navigator.base.navigate_to(Pose2D(3.0, 3.0), tolerance=0.1)
    strict.finish(task)
    assert task.failure.code == FailureCode.GOAL_OCCUPIED
    told = "0.19 m away from the goal 'dock' (3.00, 3.00), the tolerance is 0.10 m"
    assert told in task.failure.sentence


def test_it_stands_without_a_task(make):
    toy = make()
    toy.run(0.5)
    assert set(toy.commands) == {STANDSTILL}
    assert Twist() == STANDSTILL


def test_a_gap_blocked_only_when_seen_from_near_is_not_tried_for_ever(make):
    world = ToyWorld(TWO_DOORS, robot(), Pose2D(1.0, 4.5))
    toy = make(world)
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 4.8, 0.0))
    upper = (4.0, 4.8, 0.5)
    while task.running and world.time < 90:
        seen = world.pose.distance_to(Pose2D(*upper[:2])) < 1.6
        world.circles = [upper] if seen else []
        toy.step()
    assert task.status is TaskStatus.SUCCEEDED
    assert sum(kind == "replan" for kind in toy.kinds()) < 12
