"""Which via goals a drive has passed."""

from hypothesis import given
from hypothesis import strategies as st

from stack.navigation.plans.goal_sequence import PASSED_WHEN_RECEDING, GoalSequence
from stack.types import Pose2D

RADIUS = 0.5
VIAS = [Pose2D(2.0, 0.0), Pose2D(4.0, 0.0), Pose2D(6.0, 0.0)]


def driven(x: float, y: float = 0.0) -> Pose2D:
    return Pose2D(x, y)


def test_a_via_goal_is_passed_when_the_robot_moves_away_from_it():
    goals = GoalSequence(VIAS)
    goals.follow((100.0, 101.0, 102.0))  # ends of legs that are never driven
    for x in (1.0, 1.8, 1.9):
        goals.pass_by(driven(x), x, RADIUS, waiting=False)
    assert goals.next == VIAS[0]
    goals.pass_by(driven(1.9 - 1.5 * PASSED_WHEN_RECEDING), 1.9, RADIUS, waiting=False)
    assert goals.next == VIAS[1]


def test_in_front_of_an_obstacle_a_via_goal_within_the_radius_is_passed():
    goals = GoalSequence(VIAS)
    goals.follow((100.0, 101.0, 102.0))
    goals.pass_by(driven(1.4), 1.4, RADIUS, waiting=True)
    assert goals.next == VIAS[0]  # 0.6 m away
    goals.pass_by(driven(1.6), 1.6, RADIUS, waiting=True)
    assert goals.next == VIAS[1]  # 0.4 m away; the next one is 2.4 m away


def test_a_driven_leg_passes_its_goal_however_far_it_is():
    goals = GoalSequence(VIAS)
    goals.follow((2.0, 4.0, 6.0))
    goals.pass_by(driven(4.0, 3.0), 4.0, RADIUS, waiting=False)
    assert goals.left == (VIAS[2],)


def test_legs_of_another_number_of_goals_pass_nothing():
    goals = GoalSequence(VIAS)
    goals.pass_by(driven(2.0), 9.0, RADIUS, waiting=True)
    goals.follow((1.0, 2.0))
    goals.pass_by(driven(2.0), 9.0, RADIUS, waiting=True)
    assert goals.left == tuple(VIAS)


def test_another_last_goal_passes_the_rest():
    goals = GoalSequence(VIAS)
    goals.replace_last(Pose2D(9.0, 9.0))
    assert goals.only_last_left and goals.next == Pose2D(9.0, 9.0)


@given(
    st.lists(
        st.tuples(st.floats(0.0, 8.0), st.floats(-1.0, 1.0), st.floats(0.0, 9.0), st.booleans()),
        max_size=30,
    )
)
def test_the_last_goal_stays_and_none_comes_back(steps):
    goals = GoalSequence(VIAS)
    goals.follow((2.0, 4.0, 6.0))
    for x, y, travelled, waiting in steps:
        before = goals.left
        goals.pass_by(driven(x, y), travelled, RADIUS, waiting=waiting)
        assert goals.left and goals.left == before[len(before) - len(goals.left) :]
        assert goals.left[-1] == VIAS[-1]
