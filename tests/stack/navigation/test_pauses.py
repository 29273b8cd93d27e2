"""One clock: pauses, hiccups of the loop and detours of the operator."""

import pytest

from stack.components import Controller
from stack.control.path_follower import PathFollower
from stack.control.pure_pursuit.controller import PurePursuit
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.lifecycle import Timers
from stack.navigation.activities import Activities
from stack.navigation.doubt import LocalisationMonitor
from stack.navigation.parameters import NavigationParameters
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.types import STANDSTILL, FailureCode, Perceived, Pose2D, TaskStatus, Twist
from tests.stack.navigation.toy_world import ToyWorld, moving, robot, room

GOAL = Pose2D(7.0, 3.0)


class Noting(PurePursuit):
    """Pure pursuit that notes the times and calls it gets."""

    def __init__(self, world):
        super().__init__(PurePursuitParameters(), world.robot, world.period)
        self.world, self.lags, self.calls = world, [], []

    def step(self, state):
        self.lags.append(self.world.time - state.time)
        return super().step(state)

    def start(self, now):
        self.calls.append(("start", now))
        super().start(now)

    def pause(self, now):
        self.calls.append(("pause", now))
        super().pause(now)

    def resume(self, now):
        self.calls.append(("resume", now))
        super().resume(now)

    def stop(self, now):
        self.calls.append(("stop", now))
        super().stop(now)


@pytest.fixture
def toy(make):
    world = ToyWorld(room(8, 6), robot(), Pose2D(1.0, 3.0))
    noting = Noting(world)
    follower = PathFollower(lambda *_: noting, noting.parameters, world.robot, world.period)
    made = make(world, follower=follower)
    made.controller = noting
    return made


def hold(toy, seconds):
    """Pause, let the time pass while the robot brakes and stands, and resume."""
    toy.navigator.pause(toy.world.time)
    for _ in range(round(seconds / toy.world.period)):
        toy.world.drive(STANDSTILL)
    toy.navigator.resume(toy.world.time)


@pytest.mark.parametrize("pauses", [1, 3])
def test_after_a_pause_the_time_is_still_that_of_the_scans(toy, pauses):
    task = toy.navigator.base.navigate_to(GOAL)
    for _ in range(pauses):
        toy.run(1.0)
        hold(toy, 5.0)
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert set(toy.controller.lags) == {0.0}  # once 5 s, 10 s… behind the stamps of the scans


def test_after_a_hiccup_of_the_loop_the_time_is_still_that_of_the_scans(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(1.0)
    toy.world.time += 0.2  # four periods without a step
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert set(toy.controller.lags) == {0.0}


def test_a_detour_is_no_time_without_progress(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(2.0)
    toy.navigator.pause(toy.world.time)
    here = toy.world.pose
    for goal in (Pose2D(2.0, 5.0), Pose2D(2.0, 1.0), here):  # away for longer than progress_time
        assert toy.finish(toy.navigator.base.navigate_to(goal)) is TaskStatus.SUCCEEDED
    toy.run(10.0)
    assert task.running and toy.navigator.goal == GOAL  # still shown, and held
    assert toy.navigator.local_plan is None
    toy.navigator.resume(toy.world.time)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure


def test_a_detour_that_is_undone_is_cancelled_and_the_mission_continues(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(2.0)
    toy.navigator.pause(toy.world.time)
    detour = toy.navigator.base.navigate_to(Pose2D(1.0, 5.0))
    toy.run(9.0, lambda: toy.world.pose.y > 3.5)
    assert toy.navigator.goal == Pose2D(1.0, 5.0) and task.running
    toy.navigator.resume(toy.world.time)
    assert detour.status is TaskStatus.CANCELLED
    assert detour.feedback == "the mission continues"
    assert toy.navigator.goal == GOAL
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure


def test_a_second_detour_replaces_the_first_and_not_the_mission(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(1.0)
    toy.navigator.pause(toy.world.time)
    first = toy.navigator.base.navigate_to(Pose2D(1.0, 5.0))
    toy.run(1.0)
    second = toy.navigator.base.navigate_to(Pose2D(1.0, 1.0))
    assert first.status is TaskStatus.CANCELLED and second.running and task.running


def test_the_robot_stands_while_the_mission_is_held(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(2.0)
    toy.navigator.pause(toy.world.time)
    toy.run(30.0)  # with steps: a real robot senses on
    assert set(toy.commands[-600:]) == {STANDSTILL} and task.running
    toy.navigator.resume(toy.world.time)
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def test_a_controller_is_started_held_and_stopped(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(1.0)
    hold(toy, 1.0)
    toy.finish(task)
    named = [name for name, _ in toy.controller.calls]
    assert named == ["start", "pause", "resume", "stop"]
    assert toy.controller.calls[1][1] == pytest.approx(1.0)
    assert toy.controller.calls[2][1] == pytest.approx(2.0)


@pytest.mark.parametrize("cancelled", [True, False])
def test_a_controller_is_stopped_when_the_navigator_is_closed(toy, cancelled):
    """Nothing steps the navigator after the end of a mission."""
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(1.0)
    if cancelled:
        task.cancel()
    toy.navigator.close(7.0)
    assert [name for name, _ in toy.controller.calls] == ["start", "stop"]
    assert toy.controller.calls[-1] == ("stop", 7.0)
    assert task.status is TaskStatus.CANCELLED


def test_after_a_detour_the_controller_gets_the_path_of_the_mission_again(toy):
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(1.0)
    path = toy.navigator.path
    toy.navigator.pause(toy.world.time)
    toy.finish(toy.navigator.base.navigate_to(Pose2D(2.0, 4.0)))
    toy.navigator.resume(toy.world.time)
    assert toy.navigator.path is path and task.running
    toy.step()
    assert toy.commands[-1] != STANDSTILL


@pytest.mark.parametrize("begin", [
    lambda navigator: navigator.base.spin(3.0),
    lambda navigator: navigator.base.drive_on_heading(2.0),
    lambda navigator: navigator.base.escape(clearance=0.7, distance=1.0),
])  # fmt: skip
def test_recoveries_do_not_count_a_pause(make, begin):
    walls = [*room(8, 6), (0.5, 2.5, 1.6, 2.5)]
    toy = make(ToyWorld(walls, moving("differential"), Pose2D(1.0, 3.0)))
    task = begin(toy.navigator)
    toy.run(0.5)
    for _ in range(3):
        hold(toy, 20.0)  # stall_time is 3 s, the deadlines are below 45 s
        toy.run(0.3)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure


def test_a_velocity_on_command_is_driven_for_its_whole_time(toy):
    task = toy.navigator.base.drive_for(Twist(0.2), 2.0)
    toy.run(1.0)
    hold(toy, 5.0)
    assert task.running
    # From t = 0, the time before the first step: it drives 20 steps before and 20 after the pause.
    assert toy.run(5.0, lambda: not task.running) == pytest.approx(1.05)


def test_timers_leave_pauses_out():
    timers = Timers()
    one, two = timers.new(), timers.new()
    one.start(10.0)
    timers.pause(12.0)
    timers.pause(13.0)  # held already: nothing changes
    timers.resume(20.0)
    two.start(20.0)
    timers.resume(21.0)  # not held
    assert one.elapsed(21.0) == pytest.approx(3.0)
    assert two.elapsed(21.0) == pytest.approx(1.0)
    one.reset()
    assert one.elapsed(30.0) == 0.0 and not one.running


def test_timers_stand_still_during_a_pause():
    timers = Timers()
    before, within = timers.new(), timers.new()
    before.start(8.0)
    timers.pause(10.0)
    within.start(12.0)
    assert before.elapsed(15.0) == 2.0
    assert within.elapsed(15.0) == 0.0
    timers.resume(20.0)
    assert before.elapsed(21.0) == pytest.approx(3.0)
    assert within.elapsed(21.0) == pytest.approx(1.0)  # not 21 - (12 + 10), in the future


class Failing(MotionExecutor):
    """Raises in one call of its lifecycle."""

    def __init__(self, task, where):
        super().__init__(task)
        self.where = where

    def _note(self, where):
        if where == self.where:
            raise ZeroDivisionError(where)

    def start(self, now):
        self._note("start")

    def step(self, state):
        self._note("step")
        return Twist(0.1)

    def pause(self, now):
        self._note("pause")

    def resume(self, now):
        self._note("resume")

    def stop(self, now):
        self._note("stop")


@pytest.mark.parametrize("where", ["start", "step", "pause", "resume", "stop"])
def test_an_exception_in_any_call_of_the_lifecycle_stays_in_the_task(where):
    events, log, world = [], [], ToyWorld(room(8, 6), robot())

    def emit(kind, text, level="info", **_):
        events.append((level, text))

    activities = Activities(emit, LocalisationMonitor(emit, 0.05), log.append)
    task = MotionTask("test", lambda task: None)
    state = Perceived(0.0, world.estimate, world.odometry)
    activities.begin(Failing(task, where))
    activities.step(state, NavigationParameters())
    activities.pause(1.0)
    activities.resume(2.0)
    if where == "stop":
        activities.cancel("enough")
        assert activities.step(state, NavigationParameters()) == STANDSTILL
        ((level, text),) = events
        assert level == "warning"
        wanted = "test raised an exception when it stopped: ZeroDivisionError: stop (test_pauses.py"
        assert text.startswith(wanted)
    else:
        assert task.failure.code == FailureCode.EXCEPTION
        wanted = f"raised an exception: ZeroDivisionError: {where} (test_pauses.py:"
        assert wanted in task.failure.sentence
        assert f"ZeroDivisionError: {where}" in log[0] and log[0].startswith("test raised")
        assert activities.step(state, NavigationParameters()) == STANDSTILL
        assert activities.current is None


def test_the_lifecycle_of_a_controller_is_optional():
    class Least(Controller):
        def set_segment(self, segment):
            pass

        def step(self, state):
            return Twist(0.1)

    least = Least("parameters", None, 0.05)
    for call in (least.start, least.pause, least.resume, least.stop):
        call(1.0)
    least.configure("others")
    assert least.parameters == "others" and least.local_plan is None and not least.needs_tracks
    assert not least.keeps_clear
