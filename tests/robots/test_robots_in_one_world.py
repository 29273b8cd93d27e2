"""Two simulated robots in one world: one clock, and each is an obstacle of the other."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from robots.simulated import SimulatedBody
from stack.body import BodyCommand, ContactTally
from stack.sim.people import Walker
from stack.sim.simulation import Simulation
from stack.sim.timeline import Timeline
from stack.sim.worlds.world import Box, Person, Trigger, WorldEvent
from stack.types import Pose2D, Twist
from tests.stack.sim.sim_rover import CAMERA, EMPTY, EQUIPPED, LIDAR, ROVER

SEEING = replace(ROVER, lidar=LIDAR)
ORIGIN, AHEAD = Pose2D(0.0, 0.0), Pose2D(2.0, 0.0, pi)


@pytest.fixture
def pair():
    """Two robots in a world: the first at the origin, the second 2 m ahead, facing it."""
    worlds = []

    def make(world=EMPTY, robots=(SEEING, SEEING), starts=(ORIGIN, AHEAD)):
        simulation = Simulation(world)
        worlds.append(simulation)
        return [
            SimulatedBody(robot, world, start=start, seed=seed, simulation=simulation)
            for seed, (robot, start) in enumerate(zip(robots, starts, strict=True))
        ]

    yield make
    for simulation in worlds:
        simulation.close()


def drive_both(one, other, twists, seconds, period=0.05):
    for _ in range(round(seconds / period)):
        for body, twist in zip((one, other), twists, strict=True):
            body.sense()
            body.command(BodyCommand(twist))
            body.wait(period)


def test_time_passes_when_both_robots_wait(pair):
    one, other = pair()
    one.wait(0.05)
    assert (one.time, one.is_due) == (0.0, False)
    other.wait(0.05)
    assert one.time == other.time == pytest.approx(0.05)
    assert one.is_due


def test_robots_with_different_periods_share_the_clock(pair):
    one, other = pair()
    one.wait(0.1)
    other.wait(0.04)
    assert one.time == pytest.approx(0.04)
    assert (one.is_due, other.is_due) == (False, True)
    other.wait(0.04)
    other.wait(0.04)
    assert one.time == pytest.approx(0.1)  # the earliest of 0.1 and 0.12
    assert (one.is_due, other.is_due) == (True, False)


def test_time_stands_only_while_every_robot_asks_for_it(pair):
    one, other = pair()
    assert not one.freeze(True)
    one.wait(0.05)
    assert not other.freeze(True)  # the first waits for time to pass
    other.wait(0.05)
    assert one.freeze(True)
    assert other.freeze(True)
    assert not one.freeze(False)
    assert not other.freeze(True)


def test_a_robot_that_left_is_waited_for_no_longer_and_stays_where_it_is(pair):
    one, other = pair()
    one.wait(0.05)
    other.close()
    assert one.time == pytest.approx(0.05)
    for _ in range(20):
        one.wait(0.05)
    assert one.sense().measurements["lidar"].ranges[180] == pytest.approx(1.72, abs=1e-3)


def test_a_lidar_sees_the_footprint_of_the_other_robot(pair):
    one, _ = pair()
    scan = one.sense().measurements["lidar"]
    middle = int(np.argmin(np.abs(scan.angles)))
    # 2 m between the bases, less 0.18 m of footprint and 0.1 m of the lidar's mount.
    assert scan.ranges[middle] == pytest.approx(1.72, abs=1e-3)
    seen = np.isfinite(scan.ranges)
    # The front edge is 0.48 m wide: half of it at 1.72 m is atan(0.24 / 1.72) = 7.9 degrees.
    assert np.abs(np.degrees(scan.angles[seen])).max() == pytest.approx(7.9, abs=1.0)


def test_a_lidar_sees_over_a_lower_robot(pair):
    one, _ = pair(robots=(SEEING, replace(SEEING, height=0.19)))  # the lidar is at 0.2 m
    assert not np.isfinite(one.sense().measurements["lidar"].ranges).any()


def test_the_other_robot_is_seen_where_it_has_driven(pair):
    one, other = pair()
    drive_both(one, other, (Twist(), Twist(0.4)), 2.0)
    scan = one.sense().measurements["lidar"]
    middle = int(np.argmin(np.abs(scan.angles)))
    gap = other.truth.pose.x - 0.18 - 0.1
    assert other.truth.pose.x < 1.4
    assert scan.ranges[middle] == pytest.approx(gap, abs=0.05)  # a scan is at most 0.1 s old


def test_a_contact_is_the_moving_robots(pair):
    one, other = pair(starts=(ORIGIN, Pose2D(0.8, 0.0, pi)))
    drive_both(one, other, (Twist(0.3), Twist()), 2.5)
    assert one.tally == ContactTally(by_robot=1, against_standing=0)
    assert other.tally == ContactTally(by_robot=0, against_standing=1)
    assert one.clearance == pytest.approx(0.0, abs=2e-3)
    assert one.take_events()[0][1].startswith("contact with the robot rover at (0.")


def test_a_door_moves_for_both_and_a_lift_is_the_robots_at_the_place(pair):
    lift = WorldEvent(Trigger(near=(2.0, 0.0, 0.1)), move_robot=Pose2D(5.0, 5.0, 0.0))
    one, other = pair(replace(EMPTY, timeline=(lift,)))
    drive_both(one, other, (Twist(), Twist()), 0.05)
    assert one.truth.pose.x == pytest.approx(0.0, abs=1e-3)
    assert other.truth.pose.x == pytest.approx(5.0, abs=1e-3)
    assert not one.take_events()
    assert other.take_events()[0][0] == "lifted"


def test_an_entry_without_a_place_is_the_first_robots():
    entries = (WorldEvent(Trigger(time=1.0), battery=0.5),)
    places = [ORIGIN, AHEAD]
    assert Timeline(entries).due(1.0, places) == [(entries[0], 0)]
    by_place = (WorldEvent(Trigger(near=(2.0, 0.0, 0.5)), battery=0.5),)
    assert Timeline(by_place).due(0.0, places) == [(by_place[0], 1)]


def test_people_yield_to_each_robot():
    walker = Walker(Person("Ada", np.array([[0.0, 0.0], [4.0, 0.0]]), speed=1.0))
    far, near = (Pose2D(50.0, 0.0), 0.3), (Pose2D(0.8, 0.0), 0.3)
    assert not walker.walk(0.1, [far, near])
    assert walker.walk(0.1, [far])


def test_a_camera_sees_the_other_robot(pair):
    watching = replace(EQUIPPED, camera=replace(CAMERA, latency=0.0))
    pictures = []
    for start in (Pose2D(1.2, 0.0, pi), Pose2D(-3.0, 0.0)):  # ahead of the camera; behind it
        one, other = pair(robots=(watching, ROVER), starts=(ORIGIN, start))
        one.command(BodyCommand(capture=True))
        pictures.append(one.sense().measurements["camera"].pixels.astype(int))
        one.close()
        other.close()
    changed = np.abs(pictures[0] - pictures[1]).max(axis=2) > 20
    columns = np.nonzero(changed)[1]
    # Its wheels, spheres of 0.08 m at 0.16 m on each side, are 1.05 m before the camera:
    # 280 px x 0.48 / 1.05 = 128 px about the middle column, 160.
    assert np.ptp(columns) == pytest.approx(128, abs=6)
    assert columns.mean() == pytest.approx(160, abs=4)


def test_a_robot_measures_the_same_alone_and_beside_another_behind_a_wall(pair):
    wall = replace(EMPTY, boxes=(Box(Pose2D(1.0, 0.0), (0.2, 8.0, 1.0)),))
    one, other = pair(wall, robots=(EQUIPPED, EQUIPPED))
    alone = SimulatedBody(EQUIPPED, wall, start=ORIGIN, seed=0)
    try:
        for _ in range(20):
            for body in (one, other, alone):
                body.command(BodyCommand(Twist(0.1, 0.2)))
                body.wait(0.05)
        together, single = one.sense(), alone.sense()
        assert one.truth == alone.truth
        assert np.array_equal(
            together.measurements["lidar"].ranges, single.measurements["lidar"].ranges,
            equal_nan=True,
        )  # fmt: skip
    finally:
        alone.close()
