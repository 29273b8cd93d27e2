"""Plans whose task is over before they are made, and drives to goals that cannot be reached."""

from math import inf
from threading import Event

import pytest

from stack.components import CancelToken, choose
from stack.control.path_follower import PathFollower
from stack.control.pure_pursuit.controller import PurePursuit
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.types import FailureCode, Pose2D, TaskStatus, Twist
from tests.stack.navigation.toy_world import ToyWorld, robot, room

GOAL = Pose2D(7.0, 3.0, 0.0)


class Endless:
    """A planner that plans until it is told to stop (or gives up, where that never comes)."""

    def __init__(self):
        self.begun = Event()

    def plan(self, costs, start, goal, options):
        self.begun.set()
        for _ in range(20_000_000):
            options.cancel.check()
        raise AssertionError("nobody stopped it")


def plan_only(navigator):
    return navigator.base.plan(GOAL)


def drive(navigator):
    return navigator.base.navigate_to(GOAL)


@pytest.mark.parametrize("ask", [plan_only, drive])
@pytest.mark.parametrize("end", ["cancel", "cancel_all", "newer"])
def test_a_task_that_ends_takes_its_plan_with_it(make, ask, end):
    planner = Endless()
    toy = make(planner=planner, is_real_time=True)
    task = ask(toy.navigator)
    toy.step()
    assert planner.begun.wait(60.0)
    future = task.future
    assert future is not None and not future.over
    if end == "cancel":
        task.cancel()
    elif end == "cancel_all" or ask is plan_only:  # a newer goal leaves plans without a drive
        toy.navigator.cancel_all()
    else:
        toy.navigator.base.navigate_to(Pose2D(2.0, 2.0))
    assert future._future.exception() is not None  # it comes back at once
    assert future.result(inf).code == FailureCode.CANCELLED


def test_a_held_drive_is_cancelled_at_the_end_of_the_run(make):
    toy = make(planner=Endless(), is_real_time=True)
    task = toy.navigator.base.navigate_to(GOAL)
    toy.step()
    toy.navigator.pause(toy.world.time)
    toy.navigator.close()
    assert task.status is TaskStatus.CANCELLED
    assert task.future.result(inf).code == FailureCode.CANCELLED


def test_every_caller_sees_a_cancel_request():
    cancel = CancelToken()
    cancel.check()
    cancel.request()
    with pytest.raises(Exception, match="CANCELLED: the plan was cancelled"):
        cancel.check()


def shut(make, **planner):
    """Two halves of a room with no way between them; the wall runs along x = 4."""
    world = ToyWorld([*room(8, 6), (4, 0, 4, 6)], robot(), Pose2D(1.0, 3.0))
    choice = choose("planner", "astar", planner)
    return make(world, planner=choice.component(choice.parameters, world.robot))


def test_with_partial_it_comes_as_near_as_it_can_and_that_is_success(make):
    toy = shut(make)
    task = toy.navigator.base.navigate_to(GOAL, partial=True)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    # inscribed cells begin 0.2 m before the wall's; it counts as there within 0.15 m of that
    assert toy.world.pose.x == pytest.approx(3.68, abs=0.08)
    assert toy.world.pose.y == pytest.approx(3.0, abs=0.08)
    away = toy.world.pose.distance_to(GOAL)
    assert task.feedback == f"reached the nearest reachable pose, {away:.2f} m from the goal"
    assert ("partial", task.feedback) in [event[:2] for event in toy.events]


class MakesRoom(PurePursuit):
    """Drives back from the end of its path, as if it could not turn there, and comes again."""

    backward = False

    def step(self, state):
        left = state.pose.distance_to(Pose2D(3.68, 3.0))
        self.backward = left < 0.05 or (self.backward and left < 0.4)
        return Twist(-0.15) if self.backward else super().step(state)


def test_at_the_end_of_a_partial_path_it_does_not_drive_away_again(make):
    """The end of the path is 0.32 m before the wall; the drive ends 5 cm and a stop from it."""
    world = ToyWorld([*room(8, 6), (4, 0, 4, 6)], robot(), Pose2D(1.0, 3.0))
    choice = choose("planner", "astar", {})
    follower = PathFollower(MakesRoom, PurePursuitParameters(), world.robot, world.period)
    planner = choice.component(choice.parameters, world.robot)
    toy = make(world, planner=planner, follower=follower)
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 3.0, 2.0), partial=True)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    assert world.pose.x == pytest.approx(3.68, abs=0.12)
    assert toy.distance < 2.9


def test_a_tolerance_does_not_forbid_what_partial_allows(make):
    toy = shut(make)
    task = toy.navigator.base.navigate_to(GOAL, tolerance=0.1, partial=True)
    # 0.1 m from the end of the path its nose, 0.25 m before its middle, would touch the wall
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    assert toy.world.nearest > 0.0


def test_a_partial_plan_is_driven_and_then_fails_with_no_valid_path(make):
    toy = shut(make, allow_partial=True)
    task = toy.navigator.base.navigate_to(GOAL)
    assert toy.finish(task) is TaskStatus.FAILED
    assert toy.world.pose.x == pytest.approx(3.68, abs=0.08)
    assert task.failure.code == FailureCode.NO_VALID_PATH
    assert task.failure.sentence.startswith(
        "there is no path to the goal; reached the nearest reachable pose (3.6"
    )


def test_otherwise_it_stays_where_it_is(make):
    toy = shut(make)
    task = toy.navigator.base.navigate_to(GOAL)
    assert toy.finish(task) is TaskStatus.FAILED
    assert task.failure.code == FailureCode.NO_VALID_PATH
    assert toy.world.pose == Pose2D(1.0, 3.0)


def test_a_goal_that_can_be_reached_is_reached_with_partial_as_well(make):
    toy = shut(make)
    task = toy.navigator.base.navigate_to(Pose2D(2.0, 1.0, 0.0), partial=True)
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert task.feedback.startswith("reached the goal, 0.0")


def test_what_blocks_the_end_of_a_partial_path_does_not_send_it_round_to_the_other_side(make):
    """A round table with the goal inside, a little nearer to the far side once it is seen well."""
    world = ToyWorld(room(8, 6), robot(), Pose2D(1.0, 3.0), circles=[(4.0, 3.0, 0.5)])
    choice = choose("planner", "astar", {})
    toy = make(world, planner=choice.component(choice.parameters, world.robot))
    task = toy.navigator.base.navigate_to(Pose2D(3.98, 3.0, 0.0), partial=True)
    toy.run(30.0, lambda: world.pose.x > 2.5)
    world.circles[0] = (3.9, 3.0, 0.5)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    assert world.pose.x < 3.3 and toy.distance < 2.5
    assert world.nearest > 0.0
