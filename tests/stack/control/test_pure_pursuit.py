import itertools
from dataclasses import replace
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import ControlState
from stack.control.pure_pursuit.controller import PurePursuit
from stack.control.pure_pursuit.manoeuvres import ArcPrimitive
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.errors import NavigationError
from stack.geometry.path_segment import PathSegment
from stack.types import STANDSTILL, Footprint, Path, Pose2D, Twist, wrap_angle
from tests.stack.control.driver import Driver
from tests.stack.navigation.toy_world import ToyCostmap, ToyWorld, heading_error, robot, room

PERIOD = 0.05


def polyline(*corners, heading=None, spacing=0.05):
    """A path through corners, points `spacing` apart."""
    points = [np.array(corners[0], float)]
    for a, b in itertools.pairwise(corners):
        a, b = np.array(a, float), np.array(b, float)
        n = max(1, round(float(np.hypot(*(b - a))) / spacing))
        points.extend(a + (b - a) * k / n for k in range(1, n + 1))
    points = np.array(points)
    steps = np.diff(points, axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    last = headings[-1] if heading is None else heading
    return Path(np.column_stack([points, np.append(headings, last)]))


def follow(world, path, *, seconds=60.0, parameters=None, inflated=True):
    """Drive until the controller stands; the world then holds where, `trace` how."""
    parameters = parameters or PurePursuitParameters()
    controller = Driver(PurePursuit, parameters, world.robot, world.period)
    costs = ToyCostmap(world, inflation=0.55 if inflated else 0.0)
    controller.set_path(path)
    trace = []
    still = 0
    while world.time < seconds and still < 30:
        costs.update()
        command = controller.command(ControlState(world.time, world.pose, world.twist, costs.grid))
        world.drive(command)
        trace.append((world.pose.x, world.pose.y, command.linear, command.angular))
        still = still + 1 if command == STANDSTILL else 0
    return np.array(trace)


def test_a_straight_path_is_driven_at_cruise_speed_and_ends_on_the_goal():
    world = ToyWorld(room(12, 4), robot(), Pose2D(1.0, 2.0))
    trace = follow(world, polyline((1, 2), (10, 2)))
    assert trace[:, 2].max() == pytest.approx(0.8)  # the robot's limit is also the default
    assert world.pose.distance_to(Pose2D(10, 2)) < 0.03
    assert trace[:, 0].max() <= 10.01  # no overshoot
    # 9 m at 0.8 m/s is 11.25 s; speeding up at 1.0 and slowing at 0.75 m/s² cost 0.4 + 0.53 s more.
    driving = PERIOD * np.count_nonzero(trace[:, 2])
    assert driving == pytest.approx(11.25 + 0.4 + 0.53, abs=1.2)


@pytest.mark.parametrize("heading", [0.0, pi / 2, pi, -3 * pi / 4])
def test_it_turns_to_the_goals_heading_after_arriving(heading):
    world = ToyWorld(room(6, 6), robot(), Pose2D(1.0, 3.0))
    follow(world, polyline((1, 3), (4, 3), heading=heading))
    goal = Pose2D(4, 3, heading)
    assert world.pose.distance_to(goal) < 0.03
    assert heading_error(world.pose, goal) < 0.0524  # 3 degrees


def test_it_turns_in_place_when_the_path_lies_behind():
    world = ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0, pi))
    trace = follow(world, polyline((3, 3), (5, 3)))
    assert trace[:, 0].min() > 2.97  # it did not swing round through the back
    assert world.pose.distance_to(Pose2D(5, 3)) < 0.03


def test_a_right_angle_is_cut_by_less_than_a_footprint():
    world = ToyWorld(room(8, 8), robot(), Pose2D(1.0, 2.0))
    trace = follow(world, polyline((1, 2), (4, 2), (4, 6)))
    on_first = np.minimum(
        abs(trace[:, 1] - 2) + np.maximum(0, trace[:, 0] - 4),
        abs(trace[:, 0] - 4) + np.maximum(0, 2 - trace[:, 1]),
    )
    assert on_first.max() < 0.3
    assert world.pose.distance_to(Pose2D(4, 6)) < 0.03


@settings(deadline=None, max_examples=60)
@given(
    st.floats(-pi, pi), st.floats(0.02, 1.5), st.floats(-pi, pi), st.floats(-pi, pi),
    st.floats(0.2, 1.5),
)  # fmt: skip
def test_goals_near_and_in_any_direction_are_met(start, distance, bearing, heading, speed):
    world = ToyWorld(room(6, 6), robot(linear_speed=speed), Pose2D(3.0, 3.0, start))
    goal = Pose2D(
        3 + distance * float(np.cos(bearing)), 3 + distance * float(np.sin(bearing)), heading
    )
    follow(world, polyline((3, 3), (goal.x, goal.y), heading=heading), inflated=False)
    assert world.time < 30.0
    assert world.pose.distance_to(goal) < 0.061  # NOT_ARRIVED_BEYOND leaves up to 6 cm
    assert heading_error(world.pose, goal) < 0.0524


@settings(deadline=None, max_examples=40)
@given(
    st.floats(0.1, 2.0), st.floats(0.3, 3.0), st.floats(0.3, 3.0), st.floats(0.5, 6.0),
    st.lists(st.tuples(st.floats(1, 7), st.floats(1, 7)), min_size=2, max_size=5),
)  # fmt: skip
def test_commands_stay_within_the_robots_limits(speed, up, turn, turn_up, corners):
    if min(hypot(a[0] - b[0], a[1] - b[1]) for a, b in itertools.pairwise(corners)) < 0.1:
        return
    limits = {
        "linear_speed": speed, "linear_acceleration": up, "angular_speed": turn,
        "angular_acceleration": turn_up,
    }  # fmt: skip
    world = ToyWorld(room(8, 8), robot(**limits), Pose2D(*corners[0], 0.0))
    trace = follow(world, polyline(*corners), seconds=12, inflated=False)
    assert trace[:, 2].max() <= speed + 1e-9
    assert trace[:, 2].min() >= 0.0
    assert abs(trace[:, 3]).max() <= turn + 1e-9
    assert np.diff(trace[:, 2]).max(initial=0.0) <= up * PERIOD + 1e-9


def test_speed_falls_with_curvature_and_near_obstacles():
    narrow = ToyWorld([(0, 0, 9, 0), (0, 0.8, 9, 0.8)], robot(), Pose2D(1.0, 0.4))
    wide = ToyWorld(room(9, 9), robot(), Pose2D(1.0, 4.0))
    slow = follow(narrow, polyline((1, 0.4), (8, 0.4)))[:, 2].max()
    fast = follow(wide, polyline((1, 4), (8, 4)))[:, 2].max()
    # at 0.4 m from the walls, 0.2 m beyond the inscribed radius: cost 252 e^(-4·0.2) = 113
    assert slow == pytest.approx(fast * (1 - 0.5 * 113 / 252), rel=0.12)
    angles = np.linspace(0, pi, 60)
    arc = np.column_stack([4 + 0.5 * np.sin(angles), 4.5 - 0.5 * np.cos(angles), angles])
    world = ToyWorld(room(9, 9), robot(), Pose2D(4.0, 4.0))
    assert np.median(follow(world, Path(arc))[20:60, 2]) < 0.8 * 0.5 / 0.9 + 0.05


def test_it_waits_before_an_obstacle_and_goes_on_when_it_has_gone():
    world = ToyWorld(room(9, 4), robot(), Pose2D(1.0, 2.0), circles=[(4.0, 2.0, 0.2)])
    controller = Driver(
        PurePursuit, PurePursuitParameters(), world.robot, world.period, patience=60.0
    )
    controller.set_path(polyline((1, 2), (7, 2)))
    costs = ToyCostmap(world)
    for step in range(1200):
        if step == 300:
            assert world.twist.linear < 1e-3
            assert 0.0 < world.clearance() < 0.3
            world.circles.clear()
        costs.update()
        world.drive(
            controller.command(ControlState(world.time, world.pose, world.twist, costs.grid))
        )
    assert world.pose.distance_to(Pose2D(7, 2)) < 0.03
    assert world.nearest > 0.0


def test_it_gives_up_when_patience_is_over():
    world = ToyWorld(room(9, 4), robot(), Pose2D(1.0, 2.0), circles=[(4.0, 2.0, 0.2)])
    with pytest.raises(NavigationError, match="COLLISION_AHEAD: an obstacle blocks the path"):
        follow(world, polyline((1, 2), (7, 2)))
    assert world.time < 12.0


def test_a_goal_close_to_a_wall_is_reached():
    world = ToyWorld(room(6, 6), robot(), Pose2D(1.0, 3.0))
    follow(world, polyline((1, 3), (5.65, 3)))  # the wall at x = 6 is 10 cm from the nose
    assert world.pose.distance_to(Pose2D(5.65, 3)) < 0.03
    assert world.nearest > 0.0


def test_a_body_already_on_lethal_cells_may_leave():
    world = ToyWorld(room(6, 6), robot(), Pose2D(0.23, 3.0, 0.0))  # the tail is in the wall
    follow(world, polyline((0.23, 3), (3, 3)))
    assert world.pose.distance_to(Pose2D(3, 3)) < 0.03


def test_a_loop_is_driven_all_the_way_round():
    world = ToyWorld(room(6, 6), robot(), Pose2D(1.0, 1.0))
    trace = follow(world, polyline((1, 1), (5, 1), (5, 5), (1, 5), (1, 1)))
    assert np.hypot(*np.diff(trace[:, :2], axis=0).T).sum() > 14.5  # of 16 m, corners cut
    assert world.pose.distance_to(Pose2D(1, 1)) < 0.05


def test_progress_counts_the_remaining_length():
    progress = PathSegment(polyline((0, 0), (2, 0), (2, 1)))
    progress.advance(Pose2D(1.5, 0.1))
    assert (progress.length, progress.remaining) == (pytest.approx(3.0), pytest.approx(1.5))
    assert progress.offset == pytest.approx(0.1)
    x, y = progress.lookahead_point(Pose2D(1.5, 0.0), 1.0)
    assert (x, y) == (pytest.approx(2.0), pytest.approx(0.75**0.5))  # 0.5² + y² = 1


def test_the_local_plan_is_the_arc_commanded():
    world = ToyWorld(room(6, 6), robot(Footprint.circle(0.2)), Pose2D(1.0, 3.0))
    controller = Driver(PurePursuit, PurePursuitParameters(), world.robot, world.period)
    assert controller.local_plan is None
    controller.set_path(polyline((1, 3), (5, 3)))
    costs = ToyCostmap(world)
    twist = controller.command(ControlState(0.0, world.pose, Twist(0.5), costs.grid))
    plan = controller.local_plan
    assert plan.length == pytest.approx(twist.linear * 1.0, abs=1e-6)
    assert wrap_angle(plan.goal.heading) == pytest.approx(twist.angular, abs=1e-6)


@pytest.mark.parametrize(("goal", "sign"), [(5.0, 1.0), (1.0, -1.0)])
def test_the_local_plan_of_a_leg_looks_as_the_robot_does(goal, sign):
    """Ahead or backward along x, the robot looks along x all the time."""
    world = ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0))
    driver = Driver(PurePursuit, PurePursuitParameters(), world.robot, world.period)
    path = polyline((3, 3), (goal, 3))
    driver.set_path(Path(path.points * (1.0, 1.0, 0.0)))
    costs = ToyCostmap(world)
    twist = driver.command(ControlState(0.0, world.pose, STANDSTILL, costs.grid))
    assert twist.linear * sign > 0.0
    plan = driver.local_plan.points
    assert (plan[-1, 0] - plan[0, 0]) * sign > 0.0
    assert np.cos(plan[:, 2]) == pytest.approx(1.0)


def test_padding_tuned_live_is_kept_from_the_next_command_on():
    world = ToyWorld(room(9, 4), robot(), Pose2D(1.0, 2.0))
    controller = Driver(PurePursuit, PurePursuitParameters(), world.robot, world.period)
    controller.set_path(polyline((1, 2), (7, 2)))
    costs = ToyCostmap(world, inflation=0.0)
    costs.update()
    beside = np.array([[0.5, 0.26]])  # the robot's side is at 0.2 m: 6 cm to pass by
    for padding, passes in ((0.02, True), (0.1, False), (0.02, True)):
        controller.follower.configure(replace(controller.parameters, padding=padding))
        state = ControlState(world.time, world.pose, world.twist, costs.grid, points=beside)
        controller.command(state)
        segment = PathSegment(polyline((1, 2), (7, 2)))
        arc = controller.controller._arc(segment, state, (2.0, 2.0))
        assert (arc.free == np.inf) == passes


def test_a_motion_begun_long_ago_is_not_gone_on_with():
    world = ToyWorld(room(9, 4), robot(), Pose2D(4.0, 2.0))
    controller = Driver(PurePursuit, PurePursuitParameters(), world.robot, world.period)
    costs = ToyCostmap(world, inflation=0.0)
    costs.update()
    controller.set_path(polyline((4, 2), (7, 2)))
    controller.command(ControlState(0.0, world.pose, STANDSTILL, costs.grid))
    primitives = (ArcPrimitive.of(Pose2D(4.5, 2.0, 0.0), Twist(-1.0), 0.25),)
    controller.controller._manoeuvre._primitives = primitives
    controller.follower.stop(1.0)
    controller.follower.start(1.5)
    assert (
        controller.controller._manoeuvre._primitives == primitives
    )  # a newer goal just replaces the older
    controller.follower.stop(2.0)
    controller.follower.start(30.0)
    controller.set_path(polyline((6, 2), (8, 2)))
    later = ControlState(30.0, Pose2D(6.0, 2.0), STANDSTILL, costs.grid)
    assert controller.command(later).linear > 0.0  # not 1.75 m back to where that was to end


@pytest.mark.parametrize("heading", [-0.2, -0.4])
@pytest.mark.parametrize(("width", "nose"), [(0.6, 0.0), (0.65, 0.04), (0.7, 0.04)])
def test_wedged_in_a_corner_it_reverses_where_it_cannot_turn(width, nose, heading):
    """A corridor turns right by 90 degrees; the robot's diagonal is 0.64 m. It stands with its nose
    before the end wall and the path more than 45 degrees aside: a turn in place is not clear."""
    half = 0.5 * width
    walls = [
        (-1.5, half, half, half), (half, half, half, -2.5), (-1.5, -half, -half, -half),
        (-half, -half, -half, -2.5), (-1.5, half, -1.5, -half), (-half, -2.5, half, -2.5),
    ]  # fmt: skip
    segments = [tuple(3.0 + value for value in wall) for wall in walls]
    world = ToyWorld(segments, robot(), Pose2D(3.0 + nose, 3.0, heading))
    path = polyline((3.0 + nose, 3.0), (3.05, 2.9), (3.0, 1.2))
    follow(world, path, seconds=40.0, inflated=False)
    assert world.pose.distance_to(Pose2D(3.0, 1.2)) < 0.03
