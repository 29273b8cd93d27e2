from dataclasses import replace
from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import DriveState, choose
from stack.control.checkers import (
    PoseProgressChecker,
    PoseProgressParameters,
    SimpleGoalChecker,
    SimpleGoalParameters,
    SimpleProgressChecker,
    SimpleProgressParameters,
    StoppedGoalChecker,
    StoppedGoalParameters,
)
from stack.drivetrain.limits import Limits
from stack.types import Pose2D
from tests.stack.navigation.toy_world import moving, robot

GOAL = Pose2D(1.0, 1.0, 0.0)


def goal_checker(goal=GOAL, tolerance=None, **parameters):
    values = {"position": 0.1, "heading": 0.1, **parameters}
    checker = StoppedGoalChecker(replace(StoppedGoalParameters(), **values), robot())
    checker.start(0.0)
    checker.set_goal(goal, tolerance)
    return checker


def reached(checker, time, pose, standing):
    return checker.reached(DriveState(time, pose, standing, 0.0))


def progress_checker(cls=PoseProgressChecker, parameters=PoseProgressParameters, **values):
    checker = cls(replace(parameters(), **values), robot())
    checker.start(0.0)
    return checker


def stuck(checker, time, pose):
    return checker.stuck(DriveState(time, pose, standing=False, remaining=1.0))


def test_a_goal_counts_once_the_robot_stands_within_both_tolerances():
    checker = goal_checker()
    assert not reached(checker, 0.0, Pose2D(0.85, 1.0, 0.0), standing=True)
    assert not reached(checker, 0.1, Pose2D(0.95, 1.0, 0.2), standing=True)
    assert not reached(checker, 0.2, Pose2D(0.95, 1.0, 0.0), standing=False)
    assert reached(checker, 0.3, Pose2D(0.95, 1.0, 0.0), standing=True)


@pytest.mark.pain("n4921", "n1492")
def test_a_goal_counts_after_a_while_within_though_moving():
    checker = goal_checker(settle=2.0)
    near = Pose2D(0.95, 1.0, 0.05)
    assert not reached(checker, 0.0, near, standing=False)
    assert not reached(checker, 1.9, near, standing=False)
    assert reached(checker, 2.0, near, standing=False)


def test_a_pause_is_no_time_to_settle():
    checker = goal_checker(settle=2.0)
    near = Pose2D(0.95, 1.0, 0.05)
    reached(checker, 0.0, near, standing=False)
    checker.pause(1.0)
    checker.resume(11.0)
    assert not reached(checker, 11.9, near, standing=False)
    assert reached(checker, 12.0, near, standing=False)


def test_the_simple_checker_does_not_wait_for_a_standstill():
    checker = SimpleGoalChecker(SimpleGoalParameters(0.1, 0.1), robot())
    assert not reached(checker, 0.0, GOAL, standing=True)  # no goal yet
    checker.set_goal(GOAL, None)
    assert reached(checker, 0.0, Pose2D(0.95, 1.0, 0.05), standing=False)
    assert not reached(checker, 0.0, Pose2D(0.95, 1.0, 0.2), standing=True)


def test_a_task_may_set_its_own_tolerance():
    assert reached(goal_checker(tolerance=0.5), 0.0, Pose2D(0.6, 1.0), standing=True)
    assert not reached(goal_checker(tolerance=0.01), 0.0, Pose2D(0.95, 1.0), standing=True)


def test_position_is_remembered_while_turning_up_to_twice_its_tolerance():
    checker = goal_checker()
    reached(checker, 0.0, Pose2D(0.95, 1.0, 1.0), standing=False)
    assert checker.at_position
    assert reached(checker, 1.0, Pose2D(0.85, 1.0, 0.0), standing=True)
    assert not reached(checker, 2.0, Pose2D(0.75, 1.0, 0.0), standing=True)
    assert not reached(checker, 3.0, Pose2D(0.85, 1.0, 0.0), standing=True)
    assert not checker.at_position


def test_headings_compare_across_the_turn():
    checker = goal_checker(Pose2D(0, 0, 3.1))
    assert reached(checker, 0.0, Pose2D(0, 0, -3.12), standing=True)


def test_standing_still_is_stuck_after_the_time():
    checker = progress_checker()
    assert not stuck(checker, 0.0, Pose2D(0, 0))
    assert not stuck(checker, 7.9, Pose2D(0.29, 0, 0.39))
    assert stuck(checker, 8.0, Pose2D(0.29, 0, 0.39)) == "moved less than 0.3 m in 8 s"


def test_enough_motion_or_rotation_restarts_the_time():
    checker = progress_checker()
    stuck(checker, 0.0, Pose2D(0, 0))
    assert not stuck(checker, 7.0, Pose2D(0.31, 0))
    assert not stuck(checker, 14.0, Pose2D(0.31, 0, 0.41))
    assert not stuck(checker, 21.9, Pose2D(0.31, 0, 0.41))
    assert stuck(checker, 22.0, Pose2D(0.31, 0, 0.41))


def test_a_pause_and_a_new_drive_are_no_time_without_progress():
    checker = progress_checker()
    stuck(checker, 0.0, Pose2D(0, 0))
    checker.pause(5.0)
    checker.resume(105.0)
    assert not stuck(checker, 107.9, Pose2D(0, 0))
    assert stuck(checker, 108.0, Pose2D(0, 0))
    checker.pause(109.0)
    checker.stop(110.0)
    checker.start(150.0)
    assert not stuck(checker, 150.0, Pose2D(0, 0))
    assert stuck(checker, 158.0, Pose2D(0, 0))


def first_stuck(checker, heading_at, until=120.0):
    """Time of the first report while the robot turns at one place; one check each 0.05 s."""
    for step in range(round(until / 0.05)):
        time = 0.05 * step
        if stuck(checker, time, Pose2D(0.0, 0.0, heading_at(time))):
            return time
    return None


def to_and_fro(time):
    """A triangle wave between 0 and 0.5 rad at 0.5 rad/s."""
    return 0.5 * (1.0 - abs(time % 2.0 - 1.0))


def test_turning_to_and_fro_is_no_progress():
    # 0.4 rad are reached after 0.8 s and count once; 8 s later the drive fails.
    assert first_stuck(progress_checker(), to_and_fro) == pytest.approx(8.8, abs=0.051)


def test_turning_round_and_round_is_progress_for_one_turn_at_most():
    # At 1 rad/s the last new 0.4 rad before a full turn end at 16 · 0.4 = 6.4 s.
    found = first_stuck(progress_checker(), lambda time: (time + pi) % (2.0 * pi) - pi)
    assert found == pytest.approx(6.4 + 8.0, abs=0.4)


def test_a_slow_turn_to_a_path_behind_is_progress():
    assert first_stuck(progress_checker(), lambda time: min(pi, 0.1 * time), until=34.0) is None


def test_both_directions_count():
    checker = progress_checker()
    for time, heading in [(0.0, 0.0), (7.0, 0.5), (14.0, -0.5), (21.0, 0.95)]:
        assert not stuck(checker, time, Pose2D(0, 0, heading)), time
    assert stuck(checker, 29.0, Pose2D(0, 0, 0.95))


def test_the_simple_checker_counts_no_turn():
    checker = progress_checker(SimpleProgressChecker, SimpleProgressParameters)
    assert first_stuck(checker, lambda time: 0.1 * time) == pytest.approx(8.0)


@pytest.mark.parametrize(("kind", "names"), [
    ("goal_checker", ("stopped_goal", "simple_goal")),
    ("progress_checker", ("pose_progress", "simple_progress")),
])  # fmt: skip
def test_checkers_are_chosen_by_name(kind, names):
    for name in names:
        made = choose(kind, name, {}).create(robot())
        assert made.parameters == type(made).Parameters()
        made.configure(type(made).Parameters())


@pytest.mark.parametrize(
    ("cls", "parameters"),
    [
        (SimpleProgressChecker, SimpleProgressParameters),
        (PoseProgressChecker, PoseProgressParameters),
    ],
)
def test_a_car_that_drives_to_and_fro_makes_progress_while_its_path_gets_shorter(cls, parameters):
    checker = progress_checker(cls, parameters)

    def stuck_at(time, remaining):
        to_and_fro = Pose2D(0.1 * (time % 2.0), 0.0, 0.0)  # 0 and 0.1 m
        return checker.stuck(DriveState(time, to_and_fro, standing=False, remaining=remaining))

    for second in range(20):
        assert stuck_at(float(second), 2.0 - 0.05 * second) == ""  # 0.4 m in 8 s
    for second in range(20, 26):
        assert stuck_at(float(second), 2.0) == ""  # the rest of a new plan
    assert "moved less than 0.3 m" in stuck_at(27.0, 1.05)  # as short as it was before


@given(
    st.floats(0.01, 2.0), st.floats(0.02, 3.0), st.floats(0.05, 3.0), st.floats(0.05, 4.0),
    st.floats(0.0, 1.0), st.booleans(),
)  # fmt: skip
@settings(deadline=None, max_examples=40)
def test_a_robot_at_its_top_speed_makes_progress(speed, rate, gain, turn_gain, share, turns):
    """However slow it is; at a share of its speed it does not."""
    limits = Limits(
        linear_speed=speed, reverse_speed=speed, angular_speed=rate, linear_acceleration=gain,
        angular_acceleration=turn_gain,
    )  # fmt: skip
    share = 1.0 if share > 0.5 else 0.02
    made = replace(robot(), limits=limits)
    checker = PoseProgressChecker(PoseProgressParameters(), made)
    checker.start(0.0)
    x = heading = v = w = 0.0
    found = ""
    for step in range(240):
        v, w = min(speed, v + 0.1 * gain), min(rate, w + 0.1 * turn_gain)
        if turns:
            heading = min(pi, heading + 0.1 * share * w)
        else:
            x += 0.1 * share * v
        state = DriveState(0.1 * step, Pose2D(x, 0.0, heading), standing=False, remaining=50.0 - x)
        if heading < pi:
            found = found or checker.stuck(state)
    slow = share * (0.4 if turns else 0.3)
    if share == 1.0:
        assert found == ""
    elif 24.0 * share * (rate if turns else speed) < slow:
        assert found


def test_a_speed_limit_of_the_path_makes_every_robot_slow():
    checker = progress_checker()
    for second in range(60):
        pose, left = Pose2D(0.02 * second, 0.0), 3.0 - 0.02 * second
        assert not checker.stuck(
            DriveState(float(second), pose, standing=False, remaining=left, top_speed=0.02)
        )


def test_each_stroke_of_a_turn_is_progress_and_a_plan_with_more_strokes_is_none():
    checker = progress_checker()

    def stuck_at(time, reversals):
        return checker.stuck(DriveState(time, Pose2D(0, 0), False, 2.0, reversals=reversals))

    for stroke in range(6):
        assert not stuck_at(7.0 * stroke, 6 - stroke)
    assert not stuck_at(40.0, 9)
    assert stuck_at(43.0, 2)


def test_a_turn_and_a_way_count_together():
    """A car in a tight place: 0.2 m and 0.2 rad in 7 s, each too little."""
    checker = progress_checker()
    for n in range(5):
        for second in range(7):
            share = n + second / 7.0
            to_and_fro = Pose2D(0.1 * (second % 2), 0.0, 0.2 * share)
            left = 9.0 - 0.2 * share
            state = DriveState(7.0 * n + second, to_and_fro, standing=False, remaining=left)
            assert not checker.stuck(state)


@pytest.mark.parametrize(("turn", "stays"), [(0.31, False), (0.29, True)])
def test_a_car_turns_half_as_far_as_on_its_tightest_circle(turn, stays):
    """0.3 m on a radius of 0.5 m are 0.6 rad."""
    checker = PoseProgressChecker(PoseProgressParameters(), moving("ackermann"))
    checker.start(0.0)
    for n in range(4):
        stuck(checker, 7.0 * n, Pose2D(0.0, 0.0, turn * n))
    assert bool(stuck(checker, 7.0 * 3 + 2.0, Pose2D(0.0, 0.0, turn * 3))) == stays
