"""Driving from view to view until no rival is left, in a toy world with scripted rivals."""

from dataclasses import replace

import numpy as np
import pytest

from stack.components import Estimator
from stack.types import Perceived, Pose2D, PoseEstimate, RivalPose, TaskStatus, View
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyWorld, robot, room

RIVAL = Pose2D(20.0, 3.0)


class Rig:
    """A navigator in a room of 8 m x 6 m, and its estimator.

    The rival comes once the robot is past `appears_at`, and goes once it is past `resolved_at`.
    """

    def __init__(self, views, resolved_at=np.inf, rival=RIVAL, appears_at=0.0, **settings):
        self.rival, self.appears_at, self.appeared = rival, appears_at, False
        self.world = ToyWorld(room(8, 6), robot(), Pose2D(1.0, 3.0))
        self.views, self.avoided, self.health = list(views), [], 0.9
        self.resolved_at, self.resolved, self.shift = resolved_at, False, Pose2D(0.0, 0.0)
        self.lidar = "lidar"
        self.toy = ToyDrive(self.world, estimator=self, **settings)
        self.navigator = self.toy.navigator

    @property
    def estimate(self):
        self.resolved |= self.world.pose.x >= self.resolved_at
        self.appeared |= self.world.pose.x >= self.appears_at
        ambiguous = self.appeared and not self.resolved
        rivals = (RivalPose(self.rival, 0.4),) if ambiguous else ()
        return PoseEstimate(
            self.shift.compose(self.world.pose),
            np.eye(3) * 1e-4,
            self.health,
            self.shift,
            rivals=rivals,
        )

    def best_view(self, scan, avoided=()):
        self.avoided.append(list(avoided))
        return self.views.pop(0) if self.views else None

    def run(self, task, seconds=40.0):
        while task.status is TaskStatus.RUNNING and self.world.time < seconds:
            self.step()
        return task.status

    def step(self):
        world = self.world
        state = Perceived(
            world.time, self.estimate, world.odometry, world.obstacles,
            measurements={"lidar": world.scan},
        )  # fmt: skip
        twist = self.navigator.step(state).twist
        world.drive(self.toy.safety.limit(twist, world.odometry, world.obstacles))


@pytest.fixture
def make():
    made = []

    def rig(*args, **settings):
        made.append(Rig(*args, **settings))
        return made[-1]

    yield rig
    for one in made:
        one.navigator.close()


def ahead(metres, left=0.0):
    return View(Pose2D(metres, left), metres, 0.5)


def test_without_rivals_it_succeeds_at_once(make):
    rig = make([], resolved_at=0.0)
    task = rig.navigator.base.disambiguate()
    rig.step()
    assert task.status is TaskStatus.SUCCEEDED
    assert rig.avoided == []


def test_it_stops_when_the_rival_goes_on_the_way(make):
    rig = make([ahead(4.0)], resolved_at=2.5)
    task = rig.navigator.base.disambiguate()
    assert rig.run(task) is TaskStatus.SUCCEEDED
    assert 2.5 <= rig.world.pose.x < 2.7
    assert rig.navigator.goal is None


def test_each_view_is_left_out_of_the_next_choice(make):
    rig = make([ahead(1.0), ahead(1.5)])
    task = rig.navigator.base.disambiguate()
    assert rig.run(task) is TaskStatus.FAILED
    assert task.failure.code == "AMBIGUOUS"
    assert "and another place, (20.00, 3.00)" in task.failure.sentence
    assert "no other place within reach shows a difference" in task.failure.sentence
    assert [len(avoided) for avoided in rig.avoided] == [0, 1, 2]
    # The first view, seen from about 1.5 m beyond it.
    first, second = rig.avoided[-1]
    assert first.x == pytest.approx(-1.5, abs=0.4)
    assert second.distance_to(Pose2D(0.0, 0.0)) < 0.4


def test_a_jump_of_the_estimate_asks_for_another_view(make):
    rig = make([ahead(4.0), ahead(1.0)], resolved_at=3.0)
    task = rig.navigator.base.disambiguate()
    while rig.world.pose.x < 1.5:
        rig.step()
    rig.shift = Pose2D(0.5, 0.0)
    assert rig.run(task) is TaskStatus.FAILED
    assert rig.world.pose.x < 3.0
    assert [len(avoided) for avoided in rig.avoided] == [0, 0, 1]


def test_the_number_of_views_is_limited(make):
    rig = make([ahead(0.6)] * 5)
    rig.navigator.tools.configure(replace(rig.navigator.tools.parameters, view_attempts=2))
    task = rig.navigator.base.disambiguate()
    assert rig.run(task) is TaskStatus.FAILED
    assert "after 2 views; raise navigator.view_attempts" in task.failure.sentence
    assert len(rig.views) == 3


def test_a_goal_waits_until_one_pose_is_left(make):
    rig = make([ahead(2.0)], resolved_at=2.0)
    task = rig.navigator.base.navigate_to(Pose2D(5.0, 4.0))
    assert rig.run(task) is TaskStatus.SUCCEEDED
    assert rig.world.pose.distance_to(Pose2D(5.0, 4.0)) < 0.3
    assert len(rig.avoided) == 1


@pytest.mark.parametrize(("jump", "views"), [(0.0, 1), (0.8, 2)])
def test_a_rival_that_comes_on_the_way_is_told_apart_there(make, jump, views):
    """The estimate may move to the rival meanwhile; then another view is chosen."""
    rig = make([ahead(1.0, left=1.0), ahead(1.0, left=-1.0)], appears_at=2.0, resolved_at=2.6)
    goal = Pose2D(5.0, 3.0)
    task = rig.navigator.base.navigate_to(goal)
    while not rig.avoided:
        rig.step()
    assert 2.0 <= rig.world.pose.x < 2.6
    for _ in range(20):
        rig.step()
    rig.shift = Pose2D(0.0, jump)
    assert rig.run(task) is TaskStatus.SUCCEEDED
    assert rig.estimate.pose.distance_to(goal) < 0.3
    assert len(rig.avoided) == views


def test_a_rival_that_stays_on_the_way_ends_the_drive(make):
    rig = make([ahead(0.6)] * 5, appears_at=2.0)
    rig.navigator.tools.configure(replace(rig.navigator.tools.parameters, view_attempts=2))
    task = rig.navigator.base.navigate_to(Pose2D(6.0, 3.0))
    assert rig.run(task) is TaskStatus.FAILED
    assert "after 2 views; raise navigator.view_attempts" in task.failure.sentence
    for _ in range(20):
        rig.step()
    assert rig.world.odometry.twist.stands and rig.navigator.path is None


def test_a_pause_in_the_middle_of_a_view_holds_the_drive_behind_it(make):
    rig = make([ahead(1.0, left=1.0)], appears_at=2.0, resolved_at=2.6)
    task = rig.navigator.base.navigate_to(Pose2D(5.0, 3.0))
    while not rig.avoided:
        rig.step()
    rig.navigator.pause(rig.world.time)
    before = rig.world.pose
    for _ in range(100):
        rig.step()
    assert rig.world.pose.distance_to(before) < 0.3
    rig.navigator.resume(rig.world.time)
    assert rig.run(task) is TaskStatus.SUCCEEDED


def test_a_goal_is_refused_while_rivals_survive(make):
    rig = make([], ambiguous_goals="refuse")
    task = rig.navigator.base.navigate_to(Pose2D(5.0, 4.0))
    assert rig.run(task) is TaskStatus.FAILED
    assert task.failure.code == "AMBIGUOUS"
    assert rig.world.pose.x == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("rival", "goes_on"),
    [
        (Pose2D(2.4, 3.0, 0.0), True),  # 1.4 m ahead, nearer than 1.5 m and than half of 5 m
        (Pose2D(2.6, 3.0, 0.0), False),  # 1.6 m ahead
        (Pose2D(1.2, 3.0, 0.6), False),  # turned by more than 0.5 rad
    ],
)
def test_a_near_rival_is_told_apart_on_the_way(make, rival, goes_on):
    rig = make([], ambiguous_goals="refuse", resolved_at=1.6, rival=rival)
    task = rig.navigator.base.navigate_to(Pose2D(6.0, 3.0))
    assert (rig.run(task) is TaskStatus.SUCCEEDED) is goes_on
    assert goes_on or task.failure.code == "AMBIGUOUS"


def test_a_near_rival_that_stays_ends_the_drive_before_the_goal(make):
    """It is 1.4 m from the start, where the way is 5 m; at half of its distance from it, 0.7 m."""
    rig = make([], ambiguous_goals="refuse", rival=Pose2D(2.4, 3.0, 0.0))
    task = rig.navigator.base.navigate_to(Pose2D(6.0, 3.0))
    assert rig.run(task) is TaskStatus.FAILED
    assert task.failure.code == "AMBIGUOUS"
    assert rig.world.pose.x > 2.4


def test_the_robot_may_drive_in_spite_of_rivals(make):
    rig = make([])
    rig.navigator.tools.configure(replace(rig.navigator.tools.parameters, ambiguous_goals="drive"))
    assert rig.run(rig.navigator.base.navigate_to(Pose2D(3.0, 3.0))) is TaskStatus.SUCCEEDED


def test_cancelling_stops_the_drive_to_a_view(make):
    rig = make([ahead(4.0)])
    task = rig.navigator.base.disambiguate()
    while rig.world.pose.x < 1.5:
        rig.step()
    assert rig.navigator.goal is not None
    task.cancel()
    for _ in range(40):
        rig.step()
    assert rig.navigator.goal is None
    assert rig.world.pose.x < 2.2


def test_estimators_without_views_have_none():
    assert Estimator.best_view(object(), None) is None
