"""What happens to a simulated robot, and that it happens the same way each time."""

from dataclasses import replace

import numpy as np
import pytest

from stack.body import BodyCommand, ContactTally
from stack.sim.worlds.world import Box, Dock, Door, Person, Trigger, WorldEvent
from stack.types import Pose2D, Scan, Twist
from tests.stack.sim.sim_rover import EMPTY, EQUIPPED, LIDAR, ROVER, drive, square_room

ORIGIN = Pose2D(0.0, 0.0)


def test_driving_into_a_box_is_one_contact_of_the_robot(build):
    body = build(world=replace(EMPTY, boxes=(Box(Pose2D(1.0, 0.0), (0.5, 2.0, 0.5)),)))
    drive(body, Twist(0.4), 4.0)
    assert body.tally == ContactTally(by_robot=1, against_standing=0)
    assert body.clearance == pytest.approx(0.0, abs=2e-3)
    assert body.truth.pose.x == pytest.approx(0.75 - 0.18, abs=0.01)
    event, *more = body.take_events()
    assert event.kind == "contact"
    assert event.text.startswith("contact with a static obstacle at (0.7")
    assert (event.fields["touched"], event.fields["is_person"]) == ("a static obstacle", False)
    assert not more
    assert body.take_events() == []


def test_passing_by_leaves_the_clearance(build):
    body = build(world=replace(EMPTY, boxes=(Box(Pose2D(1.0, 0.8), (0.5, 0.6, 0.5)),)))
    body.sense()
    assert body.clearance < 1.0
    drive(body, Twist(0.5), 4.0)
    # The box begins at y = 0.5, a wheel (sphere of 0.08 at 0.16) ends at 0.24.
    assert body.clearance == pytest.approx(0.26, abs=0.01)
    assert body.tally == ContactTally()


def walking(*points, **more):
    return Person("Ada", np.array(points), **more)


def test_a_person_who_turns_towards_a_standing_robot_never_touches_it(build):
    # The last corner of the loop is inside the robot, which comes into view with the turn.
    person = walking([-0.2, -0.75], [0.2, -0.75], [0.0, 0.2], speed=1.0)
    body = build(world=replace(EMPTY, people=(person,)))
    drive(body, Twist(), 1.0)
    blocked = body.people[0]
    assert body.tally == ContactTally()
    assert np.hypot(*blocked[:2]) > 0.5


def test_a_person_yields_and_goes_on_when_the_robot_leaves(build):
    body = build(world=replace(EMPTY, people=(walking([2.0, 0.0], [-3.0, 0.0], speed=0.8),)))
    drive(body, Twist(), 4.0)
    gap = body.people[0, 0] - 0.2 - 0.3  # less both radii (footprint's: hypot(0.18, 0.24))
    assert gap == pytest.approx(0.5, abs=0.02)
    drive(body, Twist(-0.3), 3.0)
    assert body.people[0, 0] < 0.8
    assert body.tally == ContactTally()


def test_a_robot_driving_into_a_person_touches(build):
    body = build(world=replace(EMPTY, people=(walking([0.8, 0.0], [0.8, 0.01], speed=0.0),)))
    drive(body, Twist(0.5), 2.0)
    assert body.tally == ContactTally(by_robot=1, against_standing=0)
    contact = body.take_events()[0]
    assert contact.text.startswith("contact with Ada at (")
    assert (contact.fields["touched"], contact.fields["is_person"]) == ("Ada", True)


def test_a_door_closing_on_a_standing_robot_is_not_its_contact(build):
    world = replace(
        EMPTY,
        doors=(Door("gate", (0.15, -1.0), (0.15, 1.0)),),
        timeline=(WorldEvent(Trigger(time=0.5), close_door="gate"),),
    )
    body = build(world=world)
    drive(body, Twist(), 0.8)
    assert body.tally == ContactTally(by_robot=0, against_standing=1)


def test_doors_move_on_time_and_the_lidar_sees_it(build):
    world = replace(
        EMPTY,
        doors=(Door("gate", (2.0, -1.0), (2.0, 1.0), closed=True),),
        timeline=(
            WorldEvent(Trigger(time=0.32), open_door="gate"),
            WorldEvent(Trigger(time=0.5, after=0.2), close_door="gate"),
        ),
    )
    body = build(world=world, description=replace(ROVER, lidar=LIDAR))
    assert body.doors == {"gate": True}
    ahead = [body.sense().named("lidar", Scan).ranges[180]]
    ahead += [o.named("lidar", Scan).ranges[180] for o in drive(body, Twist(), 0.9, period=0.1)]
    # Opened at the end of the step to 0.4 s, after that instant's scan; closed again at 0.7 s.
    assert np.isinf(ahead).tolist() == [False] * 5 + [True] * 3 + [False] * 2
    assert body.doors == {"gate": True}
    assert body.scene_changes == 2
    assert [event.text for event in body.take_events()] == [
        "the door gate opened", "the door gate closed",
    ]  # fmt: skip


def test_the_battery_is_set_and_charges_on_the_dock(build):
    world = replace(
        EMPTY,
        docks=(Dock(0.2, 0.0),),
        timeline=(WorldEvent(Trigger(near=(0.0, 0.0, 0.1)), battery=0.2),),
    )
    body = build(world=world)
    assert body.sense().battery.charge == pytest.approx(0.2)
    assert [event[:2] for event in body.take_events()] == [("battery", "battery charge set to 20%")]
    battery = drive(body, Twist(), 3.0)[-1].battery
    assert battery.charging
    # 200 W for 3 s of 100 Wh
    assert battery.charge == pytest.approx(0.2 + 200 * 3 / 360_000, rel=1e-4)
    away = drive(body, Twist(0.5), 2.0)[-1].battery
    assert not away.charging


def test_a_lifted_robot_stands_elsewhere_and_its_odometry_knows_nothing(build):
    there = Pose2D(4.0, -3.0, 2.0)
    world = replace(EMPTY, timeline=(WorldEvent(Trigger(time=1.0), move_robot=there),))
    body = build(world=world, description=EQUIPPED)
    drive(body, Twist(0.5), 1.0)
    before = body.sense().wheels.pose
    assert body.truth.pose.distance_to(there) < 1e-3
    assert body.truth.twist.linear == pytest.approx(0.0, abs=1e-9)
    felt = drive(body, Twist(), 0.5)
    assert felt[-1].wheels.pose.distance_to(before) < 2e-3
    assert body.truth.pose.distance_to(there) < 2e-3
    shakes = np.concatenate([o.imu.linear_acceleration for o in felt]) - [0.0, 0.0, 9.81]
    assert np.abs(shakes).max() < 1.0
    assert body.take_events()[-1][:2] == ("lifted", "the robot was lifted to (4.00, -3.00, 2.00)")


BUSY = square_room(
    4.0,
    boxes=(Box(Pose2D(2.0, 1.0, 0.3), (0.5, 0.5, 0.5)), Box(Pose2D(1.5, -0.5), (0.3, 0.3, 0.3))),
    people=(walking([-1.0, -2.0], [2.0, 2.0], speed=0.7, pause=0.3),),
)


def record(body, pictures=False):
    """Trajectory, scans, odometry and inertia of a drive that ends in a box."""
    rows = []
    for n in range(80):
        body.command(BodyCommand(Twist(0.5, 0.3 * np.sin(0.2 * n)), capture=pictures))
        body.wait(0.05)
        seen, truth = body.sense(), body.truth
        scans = [scan.ranges.tobytes() for scan in seen.of(Scan).values()]
        spin = seen.imu.angular_velocity.tobytes()
        wheels, battery = seen.wheels, seen.battery
        rows.append((truth, wheels, battery, spin, scans))
    return rows


def test_the_same_seed_gives_the_same_bits_side_by_side(build):
    first = record(build(world=BUSY, description=EQUIPPED, seed=5))
    build(world=EMPTY)  # another simulation in the same process
    assert record(build(world=BUSY, description=EQUIPPED, seed=5)) == first


def test_another_seed_gives_other_errors_on_the_same_drive(build):
    first, other = (record(build(world=BUSY, description=EQUIPPED, seed=seed)) for seed in (5, 6))
    assert [row[0] for row in first] == [row[0] for row in other]
    assert first[-1][1] != other[-1][1]
    assert first[-1][4] != other[-1][4]


def test_using_the_camera_changes_no_other_result(build):
    quiet = record(build(world=BUSY, description=EQUIPPED))
    assert record(build(world=BUSY, description=EQUIPPED), pictures=True) == quiet
    blind = record(build(world=BUSY, description=replace(EQUIPPED, lidar=None)))
    assert [row[:4] for row in blind] == [row[:4] for row in quiet]
