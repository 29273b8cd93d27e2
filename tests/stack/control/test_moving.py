"""MPPI among people: with tracks it keeps clear of where they will be, without it does not know."""

import numpy as np
import pytest

from stack.components import ControlState
from stack.control.mppi.critics import critics
from stack.control.mppi.critics import kernels as critic_kernels
from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import BodyArrays, Obstacles, clearance_to
from stack.errors import NavigationError
from stack.types import STANDSTILL, CostGrid, Footprint, Pose2D, TrackedObject
from tests.stack.control.courses import controller
from tests.stack.control.test_mppi import judged, placed
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import ToyCostmap, ToyWorld, robot, room

RADIUS = 0.25
WALKS = {
    "crossing": ((4.5, 4.6), (0.0, -0.8)),
    "head-on": ((7.5, 3.1), (-0.7, 0.0)),
    "same direction": ((0.6, 3.05), (1.1, 0.0)),
}
"""Start (metres) and velocity (m/s) of a person, while the robot drives from x = 2 to 8."""


def track(position, velocity, radius=RADIUS):
    return TrackedObject(1, 0.0, position, velocity, radius, np.eye(4))


def passed(walk, *, follows):
    """Minimum clearance of a drive past a person who does not yield."""
    (x, y), (speed_x, speed_y) = WALKS[walk]
    world = ToyWorld(room(10, 6), robot(), Pose2D(2.0, 3.0), [(x, y, RADIUS)])
    driver, costs = controller("mppi", world), ToyCostmap(world)
    driver.set_path(polyline((2, 3), (8, 3)))
    while world.time < 15.0 and world.pose.distance_to(Pose2D(8.0, 3.0)) > 0.3:
        now = track((x, y), (speed_x, speed_y)).at(world.time)
        world.circles = [(*now.position, RADIUS)]
        costs.update()
        tracks = (now,) if follows else ()
        state = ControlState(world.time, world.pose, world.twist, costs.grid, tracks)
        try:
            twist = driver.command(state)
        except NavigationError:
            twist = STANDSTILL
        world.drive(twist)
    return world.nearest, world.time


@pytest.mark.parametrize("walk", WALKS)
def test_with_tracks_it_keeps_clear_of_people_who_do_not_yield(walk):
    clear, time = passed(walk, follows=True)
    blind, _ = passed(walk, follows=False)
    assert clear > 0.1
    assert clear > blind + 0.1
    assert time < 14.0


def planned(person, *, blind_behind=False, **parameters):
    """The follower and its command after a second of planning at standstill in an open room."""
    world = ToyWorld(room(10, 6), robot(), Pose2D(5.0, 3.0), [])
    driver, costs = controller("mppi", world, **parameters), ToyCostmap(world)
    driver.set_path(polyline((5, 3), (8, 3)))
    costs.update()
    for _ in range(20):
        state = ControlState(
            0.0, world.pose, STANDSTILL, costs.grid, (person,), blind_behind=blind_behind
        )
        try:
            twist = driver.command(state)
        except NavigationError:
            twist = STANDSTILL
    return driver.follower, twist


def test_a_plan_keeps_clear_of_who_passes_by_and_not_of_who_is_too_fast_to_leave():
    """At 3 m/s from 1.2 m away: 0.2 s until the contact, in which it drives 2 cm at 1 m/s²."""
    follower, twist = planned(track((5.0, 5.4), (-0.5, 0.0)))
    assert follower.keeps_clear(0.0) and twist != STANDSTILL
    follower, _ = planned(track((6.2, 3.0), (-3.0, 0.0)))
    assert not follower.keeps_clear(0.0)


def test_without_tracks_in_its_costs_no_plan_is_said_to_keep_clear():
    follower, _ = planned(track((5.0, 5.4), (-0.5, 0.0)), moving_weight=0.0)
    assert not follower.keeps_clear(0.0)


@pytest.mark.parametrize("blind, fastest", [(False, 0.2), (True, 0.1)])
def test_it_plans_to_back_up_slowly_where_nothing_is_seen_behind(blind, fastest):
    passer = track((5.0, 5.4), (-0.5, 0.0))
    follower, _ = planned(passer, blind_behind=blind, reverse_speed=0.2, blind_speed=0.1)
    optimiser = follower._forward._optimiser
    back = np.zeros_like(optimiser.plan)
    back[0] = -1.0
    poses, _ = optimiser.trajectory(back, Pose2D(0.0, 0.0), STANDSTILL)
    assert (poses[-2, 0] - poses[-1, 0]) / 0.05 == pytest.approx(fastest, rel=1e-3)


def near(poses, tracks, **parameters):
    """Rollouts (one) that have looked around on an empty floor."""
    rollouts = placed(poses)
    costs = CostGrid(np.zeros((80, 80), np.uint8), 0.05, (-2.0, -2.0))
    around = Obstacles.of(costs, Pose2D(0.0, 0.0), np.zeros((1, 2)), tracks)
    outline = BodyArrays.of(Footprint.circle(0.2), 0.05)
    critics.evaluate_obstacles(
        critic_kernels, MppiParameters(**parameters), rollouts, around, outline
    )
    return rollouts, outline.discs[0, 2]


def test_closeness_is_the_clearance_that_is_missing_when_the_rollout_comes_by():
    standing = [(0.0, 0.0)] * 4
    walker = track((1.0, 0.0), (-4.0, 0.0), 0.2)  # at 0.8, 0.6, 0.4, 0.2 m after 0.05 s each
    rollouts, reach = near(standing, [walker], moving_margin=0.5)
    rooms = [0.8 - 0.2 - reach, 0.6 - 0.2 - reach, 0.4 - 0.2 - reach]
    missing = [0.5 - max(room, 0.0) for room in rooms]
    assert rollouts.hits[0] == 2  # the third step touches, and what follows does not count
    assert rollouts.closeness[0] == pytest.approx(sum(missing) / 4, rel=1e-4)
    expected = 10.0 * sum(missing) / 4
    assert judged(critics.moving, rollouts, moving=True, moving_weight=10.0) == pytest.approx(
        expected, rel=1e-4
    )


def test_the_room_beside_somebody_is_what_is_left_between_two_circles():
    """A walker from (1, 2) with (0.5, -0.25) m/s is at (2, 1.5) after 2 s."""
    outline = BodyArrays.of(Footprint.circle(0.2), 0.05)
    radius = float(outline.discs[0, 2])
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 1.0], [-1.0, -2.5, 0.3]])
    rooms = clearance_to(
        outline, poses, np.array([0.0, 2.0, 2.0, 2.0]), track((1.0, 2.0), (0.5, -0.25), 0.3)
    )
    apart = np.array([5.0**0.5, 2.5, 1.5, 5.0])
    assert rooms == pytest.approx(apart - radius - 0.3, abs=1e-6)


def test_the_room_beside_a_long_robot_turns_with_it():
    """1 m by 0.2 m: along it, it reaches 0.5 m, across it 0.1 m; discs stand out a little."""
    long = Footprint(np.array([[-0.5, -0.1], [0.5, -0.1], [0.5, 0.1], [-0.5, 0.1]]))
    outline = BodyArrays.of(long, 0.05)
    headings = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2]])
    for side in (2.0, -2.0):
        somebody = track((0.0, side), (0.0, 0.0), 0.3)
        across, along = clearance_to(outline, headings, np.zeros(2), somebody)
        assert across == pytest.approx(2.0 - 0.3 - 0.1, abs=0.08)
        assert along == pytest.approx(2.0 - 0.3 - 0.5, abs=0.08)


def test_nobody_near_costs_nothing():
    rollouts, _ = near([(0.0, 0.0)] * 4, [track((1.5, 0.0), (1.0, 0.0))])
    assert rollouts.closeness[0] == 0.0 and rollouts.hits[0] == 4
    assert judged(critics.moving, rollouts, moving=True) == 0.0
    rollouts.closeness[:] = 1.0
    assert judged(critics.moving, rollouts, moving=False) == 0.0


def test_without_tracks_nothing_changes():
    world = ToyWorld(room(6, 6), robot(), Pose2D(1.0, 3.0))
    costs, twists = ToyCostmap(world), []
    for parameters in ({}, {"moving_weight": 0.0}):
        driver = controller("mppi", world, **parameters)
        driver.set_path(polyline((1, 3), (5, 3)))
        state = ControlState(0.0, world.pose, world.twist, costs.grid)
        twists.append([driver.command(state) for _ in range(5)])
    assert twists[0] == twists[1]


def test_a_track_goes_on_as_it_went():
    later = track((1.0, 2.0), (0.5, -1.0)).at(2.0)
    assert (later.stamp, later.position, later.velocity) == (2.0, (2.0, 0.0), (0.5, -1.0))
