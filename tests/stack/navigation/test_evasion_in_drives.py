"""What evasion may change of a drive: nothing while the robot is lost, or after its end."""

from __future__ import annotations

from math import hypot, inf

import numpy as np
import pytest

from stack.control.path_follower import PathFollower
from stack.control.pure_pursuit.controller import PurePursuit
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.navigation.people import give_way
from stack.navigation.people.narrow_meeting import Meeting
from stack.types import STANDSTILL, Pose2D, TaskStatus, TrackedObject
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyCostmap, ToyWorld, robot, room

GOAL = Pose2D(9.0, 3.0)


def walking_at(toy: ToyDrive, begins: float = 0.0) -> None:
    """Somebody walks at the robot: 4 m away at the time `begins`, 0.8 m/s, then past it."""

    def tracks():
        pose, time = toy.world.pose, toy.world.time
        if time < begins:
            return []
        x = toy.met_at + 4.0 - 0.8 * (time - begins)
        return [TrackedObject(7, time, (x, pose.y), (-0.8, 0.0), 0.25, 0.01 * np.eye(4))]

    toy.met_at = toy.world.pose.x
    toy.tracks = tracks


@pytest.fixture
def toy() -> ToyDrive:
    return ToyDrive(ToyWorld(room(10.0, 6.0), robot(), Pose2D(1.0, 3.0)), lost_time=60.0)


def test_a_lost_robot_stands_although_somebody_walks_at_it(toy):
    toy.navigator.base.navigate_to(GOAL)
    toy.run(2.0)
    toy.health = 0.0
    toy.step()
    walking_at(toy, toy.world.time)
    toy.commands.clear()
    toy.run(4.0)
    assert set(toy.commands) == {STANDSTILL}
    assert "evasion" not in toy.kinds()


def test_a_robot_that_was_lost_during_an_evasion_plans_from_where_it_is(toy):
    """It would first turn back to its path."""
    toy.navigator.base.navigate_to(GOAL)
    toy.run(2.0)
    walking_at(toy, toy.world.time)
    toy.run(10.0, lambda: "evasion" in toy.kinds() and abs(toy.world.pose.y - 3.0) > 0.3)
    assert abs(toy.world.pose.y - 3.0) > 0.3
    toy.health, toy.tracks, before = 0.0, list, len(toy.events)
    toy.run(1.0)
    toy.health = 0.9
    toy.run(2.0)
    reasons = [fields.get("reason", "") for _, _, fields in toy.events[before:]]
    assert [reason for reason in reasons if "after an evasion" in reason]


def test_a_robot_that_drives_by_odometry_evades_slowly(toy):
    toy.navigator.base.navigate_to(GOAL)
    toy.run(2.0)
    toy.health, toy.obscured = 0.0, True
    walking_at(toy, toy.world.time)
    toy.step()
    limit = toy.navigator.tools.parameters.obscured_speed
    toy.commands.clear()
    toy.run(4.0)
    assert "evasion" in toy.kinds()
    assert max(hypot(twist.linear, twist.lateral) for twist in toy.commands) <= limit + 1e-9


def test_the_next_drive_knows_nothing_of_an_evasion_during_which_the_last_one_ended(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    walking_at(toy)
    toy.run(10.0, lambda: "evasion" in toy.kinds())
    task.cancel()
    toy.tracks = list
    toy.run(2.0)
    assert toy.commands[-1] == STANDSTILL
    before = len(toy.events)
    assert toy.finish(toy.navigator.base.navigate_to(GOAL)) is TaskStatus.SUCCEEDED
    reasons = [fields.get("reason", "") for _, _, fields in toy.events[before:]]
    assert not [reason for reason in reasons if "evasion" in reason]


class KeepingClear(PurePursuit):
    """A controller whose plans keep clear of people."""

    keeps_clear = True


def test_a_controller_keeps_clear_only_in_a_step_that_it_computed():
    world = ToyWorld(room(10.0, 6.0), robot(), Pose2D(1.0, 3.0))
    follower = PathFollower(KeepingClear, PurePursuitParameters(), world.robot, world.period)
    toy = ToyDrive(world, follower=follower)
    assert not follower.keeps_clear(world.time)
    toy.navigator.base.navigate_to(GOAL)
    toy.run(1.0, lambda: "plan" in toy.kinds())
    now = world.time
    toy.step()
    assert follower.keeps_clear(now)
    assert not follower.keeps_clear(world.time)  # as while the robot backs up to give way


def test_a_plan_that_was_asked_for_before_the_robot_gave_way_is_dropped():
    """It begins where the robot was then."""
    walls = [
        (0, 0, 10, 0), (10, 0, 10, 1), (10, 1, 3.5, 1), (3.5, 1, 3.5, 3), (3.5, 3, 1.5, 3),
        (1.5, 3, 1.5, 1), (1.5, 1, 0, 1), (0, 1, 0, 0),
    ]  # fmt: skip
    world = ToyWorld(walls, robot(), Pose2D(1.0, 0.5), [(5.0, 0.5, 0.25)])
    settings = {"person_patience": 60.0, "planning_latency": 1.2, "replan_period": 2.0}
    toy = ToyDrive(world, globe=ToyCostmap(ToyWorld(walls, robot())), **settings)
    there = TrackedObject(7, 0.0, (5.0, 0.5), (0.0, 0.0), 0.25, 0.01 * np.eye(4))
    toy.tracks = lambda: [there] if world.circles else []
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(60.0, lambda: world.pose.y > 1.4)
    assert world.pose.y > 1.4
    world.circles.clear()
    begins = []
    while task.running:
        path = task.path
        toy.step()
        if task.path is not path:
            x, y = task.path.points[0, :2]
            begins.append(hypot(x - world.pose.x, y - world.pose.y))
    assert task.status is TaskStatus.SUCCEEDED
    assert begins
    # 1.2 s of latency at 0.5 m/s at most
    assert max(begins) < 0.7


def test_somebody_in_front_is_given_way_to_while_another_comes_through_a_corridor(monkeypatch):
    """For whom comes there is no place: the search for one is repeated all the time."""
    walls = room(10.0, 1.0)
    world = ToyWorld(walls, robot(), Pose2D(3.0, 0.5), [(5.0, 0.5, 0.25)])
    toy = ToyDrive(world, globe=ToyCostmap(ToyWorld(walls, robot())), person_patience=60.0)
    there = TrackedObject(7, 0.0, (5.0, 0.5), (0.0, 0.0), 0.25, 0.01 * np.eye(4))
    toy.tracks = lambda: [there]
    far = np.array([[100.0, 100.0], [99.0, 100.0]])
    monkeypatch.setattr(give_way, "find_narrow_meeting", lambda *_: Meeting(there, far, inf))
    monkeypatch.setattr(
        give_way, "find_passing_place",
        lambda _, pose, ways, *__, **___: None if ways[0][0, 0] > 50.0 else Pose2D(1.0, 0.5),
    )  # fmt: skip
    toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(20.0, lambda: "give_way" in toy.kinds())
    assert "giving way to a person" in toy.events[toy.kinds().index("give_way")][1]
