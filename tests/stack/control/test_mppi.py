"""MPPI's parts on inputs small enough to be worked out by hand, and its motion models."""

import subprocess
import sys
from math import exp, hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import ControlState
from stack.control.mppi import kernels
from stack.control.mppi.critics import critics
from stack.control.mppi.critics import kernels as critic_kernels
from stack.control.mppi.critics.critics import CriticData, aim
from stack.control.mppi.optimiser import NoiseTable, bounds
from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import BodyArrays, LocalPath, Obstacles, Rollouts
from stack.drivetrain.limits import limit_speed
from stack.geometry.path_segment import PathSegment
from stack.geometry.polygons import fill_polygon
from stack.types import STANDSTILL, CostGrid, Footprint, Path, Pose2D
from tests.stack.control.courses import controller, toy_drive
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import (
    RECTANGLE,
    ToyCostmap,
    ToyWorld,
    heading_error,
    moving,
    room,
)

FREE = {"linear_acceleration": 100.0, "linear_deceleration": 100.0, "angular_acceleration": 100.0}


def driven(controls, *, model="differential", limits=None, start=(0.0, 0.0, 0.0), **parameters):
    """Rollouts of controls (axes, steps, batch) from a heading of 0."""
    controls = np.array(controls, np.float32)
    p = MppiParameters(**parameters)
    rollouts = Rollouts(*controls.shape)
    rollouts.controls[:] = controls
    limited = bounds(p, moving(model, **(limits or FREE)))
    kernels.roll_out(
        controls, np.array([*start, 1.0, 0.0], np.float32), limited, rollouts.velocities,
        rollouts.poses, rollouts.excess,
    )  # fmt: skip
    return rollouts


def constant(*speeds, steps=20):
    return [[[speed]] * steps for speed in speeds]


def placed(points, heading=0.0):
    """Rollouts (one) that are at given points, one after another."""
    rollouts = Rollouts(2, len(points), 1)
    rollouts.poses[0, :, 0], rollouts.poses[1, :, 0] = np.array(points).T
    rollouts.poses[2], rollouts.poses[3] = heading, np.cos(heading)
    rollouts.poses[4] = np.sin(heading)
    rollouts.hits[:] = len(points)
    return rollouts


def straight_path(n=21, spacing=0.1, goal=None, remaining=10.0):
    points = np.column_stack([spacing * np.arange(n), np.zeros(n)]).astype(np.float32)
    return LocalPath(
        points, np.ones(n, bool), spacing, goal or Pose2D(remaining, 0.0, 0.0), remaining
    )


def judged(critic, rollouts, path=None, furthest=0, heading=0.0, **parameters):
    """The cost that a critic alone gives to the first rollout."""
    path = path or straight_path()
    aligns_in_place = parameters.pop("aligns_in_place", True)
    moving = parameters.pop("moving", False)
    plan = np.zeros(rollouts.controls.shape[:2], np.float32)
    critic_data = CriticData(
        critic_kernels, MppiParameters(**parameters), path, plan, plan, heading, furthest,
        aligns_in_place,
        moving,
    )  # fmt: skip
    rollouts.costs[:] = 0.0
    critic(critic_data, rollouts)
    return float(rollouts.costs[0])


def test_a_straight_drive_and_a_circle_end_where_geometry_says():
    straight = driven(constant(0.5, 0.0))
    assert straight.poses[:3, -1, 0] == pytest.approx([0.5, 0.0, 0.0], abs=1e-6)  # 20 × 0.05 s
    circle = driven(constant(0.6, 1.2))
    assert circle.poses[2, -1, 0] == pytest.approx(1.2, abs=1e-6)
    # radius 0.6 / 1.2 = 0.5 m; steps of 0.06 rad by their chord's middle: within 0.1 %
    expected = [0.5 * np.sin(1.2), 0.5 * (1.0 - np.cos(1.2))]
    assert circle.poses[:2, -1, 0] == pytest.approx(expected, rel=1e-3)
    norm = np.hypot(circle.poses[3], circle.poses[4])
    assert norm == pytest.approx(np.ones_like(norm), abs=1e-5)


def test_speeds_rise_and_fall_by_the_robots_accelerations():
    limits = {"linear_acceleration": 1.0, "linear_deceleration": 2.0, "angular_acceleration": 4.0}
    rollouts = driven(
        [[[0.8]] * 4 + [[0.0]] * 4, [[1.0]] * 8], limits=limits, start=(0.3, 0.0, 0.0)
    )
    # + 1.0 × 0.05 a step, then - 2.0 × 0.05; turning + 4 × 0.05
    assert rollouts.velocities[0, :, 0] == pytest.approx(
        [0.35, 0.4, 0.45, 0.5, 0.4, 0.3, 0.2, 0.1], abs=1e-6
    )
    assert rollouts.velocities[1, :6, 0] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0, 1.0], abs=1e-6)


@pytest.mark.parametrize("rates", [(1.0, 2.0), (2.0, 1.0)])
@pytest.mark.parametrize("start", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("wanted", [-0.5, -0.35, 0.0, 0.35, 0.5])
def test_rollouts_change_speed_by_the_rule_of_the_drivetrain(rates, start, wanted):
    """In one step from either direction; a rollout never passes through zero from 0.4 m/s."""
    rise, fall = rates
    limits = {"linear_acceleration": rise, "linear_deceleration": fall, "reverse_speed": 0.5}
    rollouts = driven(
        constant(wanted, 0.0, steps=1), limits=limits, start=(start, 0.0, 0.0), time_step=0.1,
        reverse_speed=0.5,
    )  # fmt: skip
    expected = limit_speed(start, wanted, 0.1, rise, fall)
    assert rollouts.velocities[0, 0, 0] == pytest.approx(expected, abs=1e-6)


def test_excess_is_what_controls_ask_beyond_the_limits():
    rollouts = driven(constant(1.0, -2.2, steps=10), turn_speed=1.8)
    # cruise 0.8: 0.2 too fast, 1.8: 0.4 too much, ten times
    assert rollouts.excess[0] == pytest.approx(10 * 0.6, rel=1e-5)
    assert judged(critics.constraint, rollouts) == pytest.approx(4.0 * 0.05 * 6.0, rel=1e-5)


def pursued(*points, speed=0.8, lookahead=0.6, steps=3, limits=FREE, **parameters):
    """Controls (2, steps) of a pure pursuit of points from the origin, looking along x."""
    controls = np.zeros((2, steps, 1), np.float32)
    kernels.pursue(
        np.array(points, np.float32), np.array([0.0, 0.0, 0.0, 1.0, 0.0], np.float32),
        bounds(MppiParameters(**parameters), moving("differential", **limits)),
        np.array([[speed, lookahead]]), 0, controls,
    )  # fmt: skip
    return controls[:, :, 0]


def test_a_pursuit_aims_at_the_point_ahead_and_slows_for_what_it_cannot_turn_into():
    """Curvature 2 y / d²: 2 · 0.5 / 0.5 = 2 / m, which 1 rad/s allows at 0.5 m/s."""
    path = (0.0, 0.0), (0.5, 0.5), (2.0, 2.0)
    assert pursued(*path, turn_speed=1.0)[:, 0] == pytest.approx([0.5, 1.0])
    assert pursued(*path, speed=0.4, turn_speed=1.0)[:, 0] == pytest.approx([0.4, 0.8])
    right = (0.0, 0.0), (0.5, -0.5), (2.0, -2.0)
    assert pursued(*right, turn_speed=1.0)[:, 0] == pytest.approx([0.5, -1.0])


def test_a_pursuit_goes_on_from_where_it_has_come_to():
    """Towards (0.5, 0.2) on the arc of curvature 2 · 0.2 / 0.29: it stays on that arc."""
    linear, angular = pursued((0.5, 0.2), (9.0, 0.2), lookahead=0.3, steps=4)
    assert linear == pytest.approx([0.8] * 4)
    assert angular[:4] == pytest.approx([0.8 * 0.4 / 0.29] * 4, rel=0.01)


def test_a_pursuit_speeds_up_and_stops_as_the_robot_can():
    limits = {"linear_acceleration": 1.0, "linear_deceleration": 2.0, "angular_acceleration": 9.0}
    rising = pursued((5.0, 0.0), (9.0, 0.0), steps=3, limits=limits)
    assert rising[0] == pytest.approx([0.05, 0.1, 0.15])  # 1.0 m/s² · 0.05 s a step
    # before the end at 0.09 m it may drive sqrt(2 · (0.5 · 2.0) · 0.09) = 0.424 m/s, and does not
    # reach that; nor does it drive to a point behind it
    assert pursued((0.09, 0.0), steps=1, limits=FREE)[0] == pytest.approx([0.8])
    slow = {**FREE, "linear_deceleration": 2.0}
    assert pursued((0.09, 0.0), steps=1, limits=slow)[0] == pytest.approx([0.18**0.5])
    assert pursued((-1.0, 0.1), (-2.0, 0.1), steps=1)[0] == pytest.approx([0.0])


def test_a_car_turns_no_tighter_than_its_radius():
    rollouts = driven(constant(0.6, 1.8), model="ackermann")
    assert abs(rollouts.velocities[1]).max() == pytest.approx(0.6 / 0.5, rel=1e-5)
    standing = driven(constant(0.0, 1.8), model="ackermann")
    assert abs(standing.velocities[1]).max() == 0.0


def test_an_omnidirectional_robot_goes_sideways():
    rollouts = driven(constant(0.3, 0.0, 0.4), model="omni")
    assert rollouts.poses[:2, -1, 0] == pytest.approx([0.3, 0.4], abs=1e-6)


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from(["differential", "omni", "ackermann"]), st.floats(0.2, 3.0),
    st.floats(0.3, 4.0), st.floats(0.2, 5.0), st.floats(0.2, 5.0), st.floats(0.5, 10.0),
    st.integers(0, 1000),
)  # fmt: skip
def test_no_rollout_exceeds_the_limits(model, speed, turn, up, down, swing, seed):
    limits = {
        "linear_speed": speed, "angular_speed": turn, "linear_acceleration": up,
        "linear_deceleration": down, "angular_acceleration": swing,
    }  # fmt: skip
    axes = 3 if model == "omni" else 2
    controls = np.random.default_rng(seed).normal(0.0, 2.0, (axes, 30, 8))
    rollouts = driven(controls, model=model, limits=limits, cruise_speed=5.0, turn_speed=9.0)
    linear, angular = rollouts.velocities[:2].astype(float)
    assert linear.max() <= speed + 1e-5
    assert linear.min() >= -0.2 - 1e-5
    assert abs(angular).max() <= turn + 1e-5
    assert abs(np.diff(linear, axis=0, prepend=0.0)).max() <= max(up, down) * 0.05 + 1e-5
    if model == "ackermann":
        assert (abs(angular) <= abs(linear) / 0.5 + 1e-5).all()
    else:
        assert abs(np.diff(angular, axis=0, prepend=0.0)).max() <= swing * 0.05 + 1e-5


def scene(lethal, footprint=RECTANGLE, pose=Pose2D(1.025, 1.025), shape=(41, 41)):
    """Obstacles on a grid of 5 cm cells with its corner in the origin, round a pose."""
    cells = np.zeros(shape, np.uint8)
    for row, column in lethal:
        cells[row, column] = 254
    return Obstacles.of(CostGrid(cells, 0.05), pose, fill_polygon(footprint.points, 0.035))


def seen(rollouts, obstacles, footprint=RECTANGLE, **parameters):
    p = MppiParameters(**parameters)
    critics.evaluate_obstacles(
        critic_kernels, p, rollouts, obstacles, BodyArrays.of(footprint, 0.05)
    )
    return rollouts


def test_cells_under_the_robot_do_not_hold_it():
    assert scene([(20, 20)]).distance.min() > 1e5
    assert scene([(20, 30)]).distance[20, 30] == 0.0


def test_a_collision_is_found_where_the_outline_meets_a_lethal_cell():
    """The nose is 0.25 m ahead; the cell begins at x = 1.5, so 0.225 m of the way are free."""
    rollouts = placed([(x, 0.0) for x in np.arange(1, 9) * 0.05])
    seen(rollouts, scene([(20, 30)]), cruise_speed=2.0)
    assert rollouts.hits[0] == 4  # at 0.25 m; at 0.20 m there are 2.5 cm left
    # at cost 100 × (1 - 0.8 × 4 / 8)
    assert judged(critics.cost, rollouts) == pytest.approx(100.0 * 0.6, rel=1e-5)


def test_a_post_that_a_fast_edge_jumped_over_is_still_a_collision():
    """In one step from 0.2 m before it to 0.15 m behind it: no edge point lies in its cell."""
    rollouts = seen(placed([(0.05, 0.0), (0.4, 0.0)]), scene([(20, 30)]), cruise_speed=2.0)
    assert rollouts.hits[0] == 1


def test_the_heading_decides_whether_a_footprint_fits():
    """Walls 0.25 m to both sides: 0.2 m of half a width pass, 0.25 m of half a length do not."""
    lethal = [(20 + side * 5, column) for side in (-1, 1) for column in range(41)]
    along = seen(placed([(0.0, 0.0)] * 2), scene(lethal))
    across = seen(placed([(0.0, 0.0)] * 2, heading=pi / 2), scene(lethal), cruise_speed=5.0)
    assert along.hits[0] == 2
    assert across.hits[0] < 2


def test_repulsion_is_the_clearance_that_is_missing():
    """A round robot, 0.4 m from the middle of a lethal cell: clearance 0.4 - 0.2243 - 0.025."""
    shape = Footprint.circle(0.22)
    rollouts = seen(
        placed([(0.1, 0.0)]), scene([(20, 30)], shape), shape,
        obstacles_weight=2.0, obstacles_margin=0.2, critical_margin=0.0,
    )  # fmt: skip
    clearance = 0.4 - 0.22 / np.cos(pi / 16) - 0.025
    assert rollouts.repulsion[0] == pytest.approx(0.2 - clearance, abs=1e-5)
    cost = judged(critics.obstacles, rollouts, obstacles_weight=2.0, obstacles_power=2)
    assert cost == pytest.approx((2.0 * (0.2 - clearance)) ** 2, rel=1e-4)


def test_the_cost_critic_takes_the_mean_cost_under_the_base():
    cells = np.zeros((41, 41), np.uint8)
    cells[20, 21], cells[20, 22], cells[20, 23] = 126, 252, 255  # unknown costs nothing
    obstacles = Obstacles.of(
        CostGrid(cells, 0.05), Pose2D(1.025, 1.025), fill_polygon(RECTANGLE.points, 0.035)
    )
    rollouts = seen(placed([(0.0, 0.0), (0.05, 0.0), (0.1, 0.0), (0.15, 0.0)]), obstacles)
    assert rollouts.obstacle_cost[0] == pytest.approx((0.5 + 1.0) / 4)
    assert judged(critics.cost, rollouts) == pytest.approx(3.8 * 1.5 / 4, rel=1e-5)
    near = straight_path(remaining=0.4)
    assert judged(critics.cost, rollouts, near) == 0.0  # near the goal only collisions count


def test_the_goal_critics_take_means_and_apply_near_the_goal_only():
    rollouts = placed([(0.0, 0.0), (0.5, 0.0), (1.0, 0.4)], heading=0.3)
    near = straight_path(remaining=1.0)
    # distances to (1, 0): 1.0, 0.5, 0.4
    assert judged(critics.goal, rollouts, near) == pytest.approx(5.0 * 1.9 / 3, rel=1e-5)
    assert judged(critics.goal, rollouts, straight_path(remaining=2.0)) == 0.0
    behind_a_wall = straight_path(goal=Pose2D(0.2, 0.0), remaining=1.0)
    assert judged(critics.goal, rollouts, behind_a_wall) == 0.0
    close = straight_path(goal=Pose2D(0.4, 0.0, -3.0), remaining=0.4)
    turn = 2 * pi - 3.3  # from 0.3 to -3.0 the short way
    assert judged(critics.goal_angle, rollouts, close, aligns_in_place=False) == pytest.approx(
        3.0 * turn, rel=1e-5
    )
    assert judged(critics.goal_angle, rollouts, close) == 0.0  # turns at the goal instead


def test_path_align_compares_at_equal_length():
    """At 0.5 m/s for 8 steps of 0.05 s: after 4 steps 0.1 m, after 8 0.2 m; 0.3 m to the side."""
    rollouts = driven(constant(0.5, 0.0, steps=8), start=(0.5, 0.0, 0.0))
    rollouts.poses[1] += 0.3
    assert judged(critics.path_align, rollouts, furthest=5) == pytest.approx(14.0 * 0.3, rel=1e-4)
    slow = driven(constant(0.25, 0.0, steps=8), start=(0.25, 0.0, 0.0))
    assert judged(critics.path_align, slow, furthest=5) == pytest.approx(
        14.0 * (0.05 + 0.0) / 2, abs=0.36
    )  # 0.05 m lies between two path points: the nearer one counts
    blocked = straight_path()
    blocked.open[2:4] = False
    assert judged(critics.path_align, rollouts, blocked, furthest=5) == 0.0


def test_path_follow_aims_beyond_what_is_reached_at_an_open_point():
    rollouts = placed([(0.0, 0.0), (0.5, 0.4)])
    path = straight_path()
    furthest = critic_kernels.furthest_reached(rollouts.poses, rollouts.hits, path.points)
    assert furthest == 5
    # aims at 0.5 + 0.3 = 0.8 m: sqrt(0.3² + 0.4²) = 0.5 m away
    assert judged(critics.path_follow, rollouts, furthest=5) == pytest.approx(5.0 * 0.5, rel=1e-5)
    path.open[8:10] = False
    critic_data = CriticData(
        critic_kernels,
        MppiParameters(),
        path,
        rollouts.controls[..., 0],
        rollouts.controls[..., 0],
        0,
        5,
    )
    assert aim(critic_data) == pytest.approx((1.0, 0.0))


def test_only_rollouts_without_collision_say_how_far_the_path_is_reached():
    rollouts = Rollouts(2, 2, 2)
    rollouts.poses[0, -1] = [1.0, 0.4]
    rollouts.hits[:] = [1, 2]  # the one that goes farther collides
    reached = (rollouts.poses, rollouts.hits, straight_path().points)
    assert critic_kernels.furthest_reached(*reached) == 4
    rollouts.hits[:] = 1
    assert critic_kernels.furthest_reached(*reached) == 10


def test_path_angle_counts_when_the_path_lies_far_off():
    rollouts = placed([(0.0, 0.0)], heading=1.5)
    # aims at (0.3, 0): 1.5 rad off now and at the end
    cost = judged(critics.path_angle, rollouts, heading=1.5)
    assert cost == pytest.approx(2.2 * 1.5, rel=1e-5)
    assert judged(critics.path_angle, rollouts, heading=0.5) == 0.0


def test_driving_backward_costs():
    back = driven(constant(-0.2, 0.0, steps=10))
    assert judged(critics.prefer_forward, back) == pytest.approx(5.0 * 0.2 * 10 * 0.05, rel=1e-5)


def test_weights_are_the_softmin_of_the_costs():
    """Costs 1 and 1.3 at temperature 0.3: weights 1 and e^-1."""
    controls = np.array([[[0.2, 0.8]], [[1.0, -1.0]]], np.float32)
    plan = np.zeros((2, 1), np.float32)
    kernels.weighted_mean(controls, np.array([1.0, 1.3], np.float32), 0.3, plan)
    total = 1.0 + exp(-1.0)
    expected = [(0.2 + 0.8 * exp(-1.0)) / total, (1.0 - exp(-1.0)) / total]
    assert plan[:, 0] == pytest.approx(expected, rel=1e-5)


def test_noise_has_its_deviation_and_correlation():
    noise = NoiseTable(2000, 56, 0.8, [0.2, 0.4])
    assert noise.values.std(axis=(1, 2)) == pytest.approx([0.2, 0.4], rel=0.02)
    lagged = np.mean(noise.values[0, 1:] * noise.values[0, :-1]) / 0.04
    assert lagged == pytest.approx(0.8, abs=0.02)
    assert (noise.begins() <= 3 * 2000).all()
    assert noise.scales.min() == pytest.approx(0.03)


def test_the_pull_is_the_inverse_covariance_times_the_plan():
    noise = NoiseTable(16, 6, 0.7, [0.5])
    plan = np.array([[1.0, 2.0, -1.0, 0.5, 0.0, 3.0]], np.float32)
    lags = abs(np.arange(6)[:, None] - np.arange(6))
    expected = np.linalg.inv(0.25 * 0.7**lags) @ plan[0]
    assert noise.pull(plan)[0] == pytest.approx(expected, rel=1e-4, abs=1e-4)


def test_discs_cover_a_footprint_and_its_core_lies_within():
    for footprint in (RECTANGLE, Footprint.circle(0.22)):
        body = BodyArrays.of(footprint, 0.05)
        away = np.hypot(
            *(fill_polygon(footprint.points, 0.01)[:, None] - body.discs[:, :2]).transpose(2, 0, 1)
        )
        assert (away.min(axis=1) <= body.discs[away.argmin(axis=1), 2] + 1e-3).all()
        reach = np.hypot(body.core[:, 0], body.core[:, 1]) + body.core[:, 2]
        assert (reach < footprint.circumscribed_radius).all()


def test_the_local_path_begins_at_the_robot_and_ends_at_the_goal():
    progress = PathSegment(polyline((0, 0), (2, 0)))
    pose = Pose2D(1.0, 0.1)
    progress.advance(pose)
    cells = np.zeros((10, 100), np.uint8)
    cells[2, 70] = 253
    path = LocalPath.of(progress, pose, CostGrid(cells, 0.05, (-2.025, -0.1)), 5.0, 0.05)
    assert path.points[0] == pytest.approx([0.0, -0.1], abs=1e-6)
    assert path.points[-1] == pytest.approx([1.0, -0.1], abs=1e-6)
    assert path.remaining == pytest.approx(1.0)
    assert path.goal_distance == pytest.approx(hypot(1.0, 0.1))
    assert list(np.flatnonzero(~path.open)) == [10]  # x = 1.5 lies in the inscribed cell


@pytest.mark.parametrize("y", [-0.02, 0.52])
def test_a_path_beside_the_costmap_is_open(y):
    """Ten rows of 5 cm from y = 0 on, all lethal; the path runs a row below or above them."""
    costs = CostGrid(np.full((10, 40), 254, np.uint8), 0.05, (0.0, 0.0))
    track = PathSegment(polyline((0.1, y), (1.1, y)))
    assert LocalPath.of(track, Pose2D(0.1, y), costs, 5.0, 0.05).open.all()


def test_all_goals_are_reached_sideways_by_an_omnidirectional_robot():
    for goal in (Pose2D(5.0, 4.0, pi / 2), Pose2D(1.0, 3.6, 0.0)):
        toy = toy_drive("mppi", room(8, 6), Pose2D(1.2, 3.0), kind="omni", batch=500)
        task = toy.navigator.base.navigate_to(goal)
        toy.finish(task, 20.0)
        assert toy.world.pose.distance_to(goal) < 0.05, task.failure
        assert max(abs(twist.lateral) for twist in toy.commands) > 0.1
        toy.navigator.close()


@pytest.mark.parametrize(("radius", "turn"), [(1.0, pi / 2), (0.7, -pi)])
def test_a_car_keeps_to_arcs_it_can_drive(radius, turn):
    angles = np.linspace(0.0, turn, 40)
    side = np.sign(turn)
    x, y = 2.5 + radius * np.sin(abs(angles)), 4 + side * radius * (1 - np.cos(angles))
    lead = [(1 + 0.075 * k, 4.0, 0.0) for k in range(20)]
    tail = [
        (x[-1] + 0.05 * k * np.cos(turn), y[-1] + 0.05 * k * np.sin(turn), turn)
        for k in range(1, 21)
    ]
    path = Path(np.array([*lead, *zip(x, y, angles, strict=True), *tail]))
    world = ToyWorld(room(8, 8), moving("ackermann"), Pose2D(1, 4))
    driver, costs = controller("mppi", world), ToyCostmap(world)
    driver.set_path(path)
    while world.time < 15.0:
        state = ControlState(world.time, world.pose, world.twist, costs.grid)
        twist = driver.command(state)
        assert abs(twist.angular) <= abs(twist.linear) / 0.5 + 1e-9
        world.drive(twist)
        if twist == STANDSTILL and world.time > 2.0 and world.twist.linear < 1e-3:
            break
    assert world.pose.distance_to(path.goal) < 0.05
    assert heading_error(world.pose, path.goal) < 0.1


def test_choosing_controllers_loads_no_compiler():
    code = (
        "import sys; from stack.components import component;"
        "[component('controller', n) for n in ('mppi', 'dwb', 'graceful', 'pure_pursuit')];"
        "sys.exit(bool({'numba', 'cv2', 'pybullet'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
