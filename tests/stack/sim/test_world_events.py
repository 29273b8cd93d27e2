"""Battery, contacts, people and timeline, each by itself."""

from dataclasses import replace

import numpy as np
import pytest

from stack.body import ContactTally, GroundTruth
from stack.drivetrain.description import BatteryDescription
from stack.drivetrain.limits import Limits
from stack.sim.battery import Battery
from stack.sim.people import People, Walker
from stack.sim.physics.contacts import ContactCounter, is_driving
from stack.sim.timeline import Timeline
from stack.sim.worlds.world import Dock, Person, Trigger, World, WorldEvent
from stack.types import Pose2D, Twist
from tests.stack.sim.sim_rover import ROVER

FAR = [(Pose2D(100.0, 100.0), 0.3)]
REST, MOVING = Twist(), Twist(0.5)


def at(x, y, twist=REST):
    return GroundTruth(Pose2D(x, y), twist)


def test_a_battery_drains_by_power_and_charges_on_the_dock():
    description = BatteryDescription(
        capacity=10.0, idle_power=36.0, drive_power=36.0, charge_power=72.0,
        voltage_full=24.0, voltage_empty=20.0,
    )  # fmt: skip
    robot = replace(ROVER, battery=description, limits=Limits(linear_speed=0.5))
    battery = Battery(robot, (Dock(1.0, 0.0, 0.3),))
    battery.charge = 0.5
    battery.update(at(0.0, 0.0), 100.0)
    assert battery.charge == pytest.approx(0.4)  # 36 W for 100 s is 1 Wh of 10
    battery.update(at(1.0, 0.0, MOVING), 100.0)
    assert battery.charge == pytest.approx(0.2)  # top speed: 72 W; driving over a dock is no use
    assert not battery.reading(0.0).charging
    battery.update(at(1.2, 0.0), 100.0)
    assert battery.charge == pytest.approx(0.4)
    assert battery.reading(0.0).charging
    assert battery.reading(0.0).voltage == pytest.approx(21.6)
    battery.update(at(1.2, 0.0), 10_000.0)
    assert battery.charge == 1.0


def test_a_person_who_does_not_yield_walks_into_the_robot():
    there_and_back = np.array([[0.0, 0.0], [4.0, 0.0]])
    robot = [(Pose2D(1.0, 0.0), 0.25)]
    polite, blunt = (
        Walker(Person("Ada", there_and_back, speed=1.0, yields=yields)) for yields in (True, False)
    )
    for _ in range(100):
        polite.walk(0.02, robot)
        blunt.walk(0.02, robot)
    assert polite.place[0] < 0.1  # 1 m - 0.2 m - 0.25 m - 0.5 m
    assert blunt.place[0] == pytest.approx(2.0)


def touches(*entries):
    counter = ContactCounter()
    for time, touching, speed in entries:
        counter.update(time, touching, is_driving(speed))
    return counter.tally


def test_contacts_are_classified_by_the_speed_before_the_touch():
    assert touches((0.0, False, MOVING), (0.1, True, REST)) == ContactTally(1, 0)
    assert touches((0.0, False, REST), (0.1, True, MOVING)) == ContactTally(0, 1)
    assert touches((0.0, False, Twist(0.0, -0.5)), (0.1, True, REST)) == ContactTally(1, 0)


def test_a_contact_is_new_after_half_a_second_without():
    steady = [(0.1 * n, True, MOVING) for n in range(20)]
    assert touches(*steady).against_standing + touches(*steady).by_robot == 1
    rattling = [
        (0.0, False, MOVING),
        (0.1, True, MOVING),
        (0.2, False, MOVING),
        (0.5, True, MOVING),
    ]
    assert touches(*rattling) == ContactTally(1, 0)
    assert touches(*rattling, (1.0, True, MOVING)) == ContactTally(2, 0)


SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def test_people_walk_round_and_pause():
    walker = Walker(Person("p", SQUARE, speed=1.0, pause=2.0))
    for _ in range(40):
        walker.walk(0.1, FAR)
    assert walker.place == pytest.approx((4.0, 0.0))
    for _ in range(20):
        assert not walker.walk(0.1, FAR)
    for _ in range(10):
        walker.walk(0.1, FAR)
    assert walker.place == pytest.approx((4.0, 1.0))


def test_people_start_along_their_loop():
    world = World("w", (0.0, 0.0, 9.0, 9.0), people=(Person("p", SQUARE, 0.8, 0.25, start=0.625),))
    people = People(world, seed=0)
    assert people.places == pytest.approx(np.array([[2.0, 4.0, 0.25]]))  # 10 m of 16


def test_a_person_stops_before_the_robot_and_goes_on():
    walker = Walker(Person("p", SQUARE, speed=1.0, radius=0.2))
    in_the_way = [(Pose2D(2.0, 0.1), 0.3)]
    for _ in range(300):
        walker.walk(0.01, in_the_way)
    gap = 2.0 - walker.place[0] - 0.2 - 0.3
    assert gap == pytest.approx(0.5, abs=0.02)
    assert walker.walk(0.01, FAR)


@pytest.mark.parametrize("place", [Pose2D(-0.4, 0.0), Pose2D(0.3, 0.6), Pose2D(1.6, 0.0)])
def test_a_robot_behind_beside_or_far_ahead_does_not_block_a_person(place):
    walker = Walker(Person("p", SQUARE, speed=1.0, radius=0.2))
    assert walker.walk(0.01, [(place, 0.3)])


def names(world_events):
    return [event.open_door for event, _ in world_events]


def test_the_timeline_by_time_place_and_delay():
    timeline = Timeline(
        (
            WorldEvent(Trigger(time=1.0), open_door="time"),
            WorldEvent(Trigger(near=(5.0, 0.0, 0.5)), open_door="near"),
            WorldEvent(Trigger(time=3.0, near=(0.0, 0.0, 0.5)), open_door="both"),
            WorldEvent(Trigger(time=1.0, after=1.5), open_door="after"),
        )
    )
    here, there = [Pose2D(0.0, 0.0)], [Pose2D(5.3, 0.0)]
    assert names(timeline.due(0.0, here)) == []
    assert names(timeline.due(1.0, here)) == ["time"]
    assert names(timeline.due(2.0, there)) == ["near"]
    assert names(timeline.due(2.5, there)) == ["after"]
    assert names(timeline.due(3.0, there)) == []
    assert names(timeline.due(3.5, here)) == ["both"]
    assert names(timeline.due(9.0, there)) == []
