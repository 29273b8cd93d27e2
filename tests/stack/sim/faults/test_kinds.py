"""What each kind of fault does to the body of a robot in a square room."""

from dataclasses import replace
from itertools import pairwise
from math import cos, inf, isclose, pi, sin

import numpy as np
import pytest

from robots.simulated import SimulatedBody
from stack.drivetrain.description import DepthCameraDescription, OdometryNoise
from stack.sim.faults.planned import PlannedFault
from stack.sim.faults.reading import numbered
from stack.sim.faults.registry import fault_kind, fault_names, summary_of
from stack.sim.worlds.world import Box, Door, Person
from stack.types import CameraModel, Pose2D, Twist
from tests.stack.sim.sim_rover import EQUIPPED, LIDAR, ROVER, drive, square_room

HALF = 3.0
ORIGIN = Pose2D(0.0, 0.0)
ROBOT = replace(EQUIPPED, lidar=LIDAR, camera=None)
EXACT = replace(ROVER, odometry=OdometryNoise(scale_error=0.0, slip=0.0))
ROOM = square_room(HALF)
DEPTH = DepthCameraDescription(CameraModel(64, 48, 60.0, (0.1, 0.0, 0.2)))


def fault(name, *, at=0.0, lasts=inf, near=None, per_minute=0.0, **numbers):
    parameters = fault_kind(name).Parameters(**numbers)
    return PlannedFault(name, name, parameters, at, near, per_minute, lasts)


@pytest.fixture
def body_with():
    bodies = []

    def make(*faults, robot=ROBOT, world=ROOM, seed=0):
        bodies.append(SimulatedBody(robot, world, start=ORIGIN, seed=seed, faults=numbered(faults)))
        return bodies[-1]

    yield make
    for body in bodies:
        body.close()


def scans(body, seconds=1.0, twist=Twist()):
    return [seen.measurements["lidar"] for seen in drive(body, twist, seconds)
            if "lidar" in seen.measurements]  # fmt: skip


def kinds(body):
    return [(event.kind, round(body.time, 2)) for event in body.take_events()]


def test_all_kinds_have_a_sentence_and_work_with_their_defaults():
    for name in fault_names():
        kind = fault_kind(name)
        assert summary_of(kind).endswith((".", "`.", "]")) and "\n" not in summary_of(kind)
        assert kind.Parameters() == kind.Parameters()


def test_a_share_of_the_beams_is_lost(body_with):
    scan = scans(body_with(fault("lidar_dropout", share=0.3)))[-1]
    # 360 beams: three deviations of a binomial share are 3 sqrt(0.3 · 0.7 / 360) = 0.072
    assert abs(np.isinf(scan.ranges).mean() - 0.3) < 0.072


def test_ranges_are_longer_by_the_bias(body_with):
    plain, biased = (scans(body_with(*it))[-1] for it in ((), (fault("lidar_bias", bias=0.25),)))
    assert np.allclose(biased.ranges - plain.ranges, 0.25, atol=1e-6)


def test_a_sector_is_blind(body_with):
    scan = scans(body_with(fault("lidar_sector", middle=pi, width=pi / 2)))[-1]
    turned = (scan.angles - pi + pi) % (2 * pi) - pi
    assert np.array_equal(np.isnan(scan.ranges), np.abs(turned) <= pi / 4)


def test_a_frozen_lidar_repeats_its_scan_with_new_stamps(body_with):
    seen = scans(body_with(fault("lidar_frozen", at=0.5)), 1.5, Twist(0.5))
    before = [scan for scan in seen if scan.stamp < 0.5]
    after = [scan for scan in seen if scan.stamp >= 0.5]
    assert not np.array_equal(before[-1].ranges, before[0].ranges)
    assert all(np.array_equal(scan.ranges, after[0].ranges) for scan in after)
    assert all(one.stamp < other.stamp for one, other in pairwise(after))


def test_late_scans_keep_their_stamps(body_with):
    body = body_with(fault("lidar_late", delay=0.3))
    late = [seen.time - seen.measurements["lidar"].stamp for seen in drive(body, Twist(), 1.0)
            if "lidar" in seen.measurements]  # fmt: skip
    assert late and all(0.3 - 1e-6 < age < 0.3 + 0.05 + 1e-6 for age in late)


def test_a_lost_sensor_is_silent_until_the_end(body_with):
    body = body_with(fault("sensor_loss", at=0.3, lasts=0.5))
    stamps = [scan.stamp for scan in scans(body, 1.5)]
    assert [stamp for stamp in stamps if 0.3 <= stamp < 0.8 - 1e-9] == []
    assert min(stamps) < 0.3 and max(stamps) > 1.0


def test_stamps_jump(body_with):
    plain, jumped = (scans(body_with(*it))[-1] for it in ((), (fault("clock_jump", by=-0.5),)))
    assert isclose(plain.stamp - jumped.stamp, 0.5)


def test_a_gyro_with_a_bias(body_with):
    both = (drive(body_with(*it), Twist(), 0.5)[-1].measurements["imu"]
            for it in ((), (fault("gyro_bias", bias=0.2),)))  # fmt: skip
    plain, biased = both
    assert np.allclose(biased.angular_velocity[:, 2] - plain.angular_velocity[:, 2], 0.2)


def test_holes_in_depth_pictures():
    holes = fault_kind("depth_holes")
    picture = fault_kind("depth_holes").Parameters(share=0.5, size=4)
    from stack.types import DepthImage

    whole = DepthImage(0.0, np.ones((48, 64), np.float32), DEPTH.model, 0.1, 4.0)
    changed = holes(picture, np.random.default_rng(0)).changed(whole)
    # 192 tiles: three deviations of a binomial share are 3 · 0.5 / sqrt(192) = 0.11
    assert abs(np.isnan(changed.depth).mean() - 0.5) < 0.11
    assert changed.depth.shape == (48, 64) and changed.depth.dtype == np.float32


def test_slip_moves_the_robot_less_than_its_wheels_measure(body_with):
    body = body_with(fault("wheel_slip", slip=0.4), robot=EXACT)
    seen = drive(body, Twist(0.4), 3.0)[-1].measurements["wheels"]
    assert body.truth.pose.x / seen.pose.x == pytest.approx(0.6, abs=0.02)


def test_a_weak_motor_turns_the_robot_and_encoders_measure_it(body_with):
    body = body_with(fault("weak_motor", power=0.5, side="left"), robot=EXACT)
    seen = drive(body, Twist(0.3), 2.0)[-1].measurements["wheels"]
    # half the speed on the left: (v_r - v_l) / track = 0.15 / 0.32 rad/s, to the left
    assert seen.twist.angular == pytest.approx(0.15 / 0.32, rel=0.1)
    assert body.truth.pose.heading == pytest.approx(seen.pose.heading, abs=0.05)


def test_a_stuck_wheel_ends(body_with):
    body = body_with(fault("stuck_wheel", side="right", lasts=1.0), robot=EXACT)
    drive(body, Twist(0.3), 0.9)
    assert body.truth.twist.angular < -0.5  # about the right wheel: -0.3 / 0.32 rad/s
    drive(body, Twist(0.3), 1.0)
    assert abs(body.truth.twist.angular) < 0.02


def test_the_battery_sags_and_recovers(body_with):
    body = body_with(fault("battery_sag", drop=0.4, at=0.2, lasts=0.5))
    charges = [seen.battery.charge for seen in drive(body, Twist(), 1.0)]
    assert charges[0] > 0.99 and charges[-1] > 0.99 and min(charges) == pytest.approx(0.6, abs=0.01)


def test_a_push_and_a_kidnap_are_not_measured(body_with):
    body = body_with(fault("push", left=0.5, turn=0.0), fault("kidnap", at=2.0, distance=1.0))
    seen = drive(body, Twist(), 1.5)[-1]
    assert body.truth.pose.y == pytest.approx(0.5, abs=0.05)
    here = body.truth.pose
    seen = drive(body, Twist(), 1.0)[-1].measurements["wheels"]
    assert body.truth.pose.distance_to(here) == pytest.approx(1.0, abs=0.15)
    assert abs(seen.pose.x) < 0.02 and abs(seen.pose.y) < 0.02


def test_a_box_stands_before_the_lidar(body_with):
    scan = scans(body_with(fault("dropped_box", side=0.4)))[-1]
    # the box begins 1 m before the outline, the lidar is 8 cm behind that
    assert np.nanmin(scan.ranges) == pytest.approx(1.0 + 0.18 - 0.1, abs=0.01)


def test_a_door_closes_and_opens_again(body_with):
    world = replace(ROOM, doors=(Door("gate", (1.0, -1.0), (1.0, 1.0)),))
    body = body_with(fault("closed_door", at=0.2, lasts=0.5), world=world)
    drive(body, Twist(), 0.4)
    assert body.doors == {"gate": True}
    drive(body, Twist(), 0.6)
    assert body.doors == {"gate": False}


@pytest.mark.parametrize(("noticed", "problem"), [(False, ""), (True, "it does not get commands")])
def test_without_commands_the_dead_man_stops_the_robot(body_with, noticed, problem):
    body = body_with(fault("link_loss", at=1.0, lasts=1.5, noticed=noticed))
    drive(body, Twist(0.4), 0.9)
    assert body.truth.twist.linear == pytest.approx(0.4, abs=0.02) and not body.health.problem
    drive(body, Twist(0.4), 1.4)
    assert abs(body.truth.twist.linear) < 0.01 and body.health.problem == problem
    drive(body, Twist(0.4), 1.0)
    assert body.truth.twist.linear == pytest.approx(0.4, abs=0.02) and not body.health.problem


def test_a_slow_planner_is_a_live_parameter_while_it_lasts(body_with):
    body = body_with(fault("slow_planner", latency=2.0, at=0.1, lasts=0.3))
    settings = []
    for _ in range(10):
        drive(body, Twist(), 0.05)
        settings.append(body.take_settings())
    name = "navigator.planning_latency"
    assert [item for item in settings if item] == [{name: 2.0}, {name: None}]


def test_furniture_moves_and_leaves_ways_and_places():
    boxes = tuple(Box(Pose2D(x, 2.0), (0.4, 0.4, 0.5)) for x in (-2.0, -1.0, 0.0, 1.0, 2.0))
    world = replace(ROOM, boxes=boxes, places={"near": Pose2D(0.0, 1.2)})
    kind = fault_kind("moved_furniture")
    for seed in range(5):
        made = kind(kind.Parameters(share=1.0, distance=0.8), np.random.default_rng(seed))
        moved = made.changed_world(world, ROVER, ORIGIN).boxes
        far = [one.pose.distance_to(other.pose) for one, other in zip(moved, boxes, strict=True)]
        assert 0.0 < max(far) <= 0.8 and sum(away > 0.0 for away in far) >= 4
        assert min(box.pose.distance_to(Pose2D(0.0, 1.2)) for box in moved) > 0.3 + 0.2 - 1e-6
        centres = [(box.pose.x, box.pose.y) for box in moved]
        apart = [np.hypot(a[0] - b[0], a[1] - b[1]) for i, a in enumerate(centres)
                 for b in centres[:i]]  # fmt: skip
        assert min(apart) > 0.4  # no two overlap


def test_events_tell_begin_and_end(body_with):
    body = body_with(fault("gyro_bias", at=0.5, lasts=0.25))
    drive(body, Twist(), 0.45)
    assert kinds(body) == []
    drive(body, Twist(), 0.1)
    assert kinds(body) == [("fault", 0.55)]
    drive(body, Twist(), 0.3)
    assert kinds(body) == [("fault_end", 0.85)]


def test_a_fault_near_a_place(body_with):
    body = body_with(fault("gyro_bias", near=(1.0, 0.0, 0.3)))
    while not (told := kinds(body)):
        drive(body, Twist(0.4), 0.05)
        assert body.time < 5.0
    assert told[0][0] == "fault" and 0.7 <= body.truth.pose.x < 0.7 + 0.4 * 0.1


def test_random_times_have_the_probability_and_depend_on_the_seed_alone(body_with):
    times = []
    for seed in range(40):
        body = body_with(fault("battery_sag", per_minute=0.5, lasts=0.1), seed=seed % 39)
        times.append(body._faults._states[0].begins)
    assert times[0] == times[39] and len(set(times)) == 39
    # the exponential time whose probability is 1/2 within a minute has the median 60 s
    assert 35.0 < np.median(times) < 95.0


def test_a_box_without_room_has_no_effect(body_with):
    body = body_with(fault("dropped_box", x=0.0, y=0.0))
    drive(body, Twist(), 0.1)
    (begin, end) = [event for event in body.take_events() if event.kind.startswith("fault")]
    assert "no effect: no room" in end.text and begin.kind == "fault"


def people(*places):
    """Worlds with people (radius 0.2 m) who stand in these places."""
    standing = [Person(f"p{n}", np.array([place, place])) for n, place in enumerate(places)]
    return replace(ROOM, people=tuple(standing))


@pytest.mark.parametrize("kidnap", [{"distance": 1.0}, {"to": Pose2D(1.0, 0.0)}])
def test_the_robot_is_not_put_down_on_people(body_with, kidnap):
    """Six people at 1 m leave no place that is 0.5 m from all of them."""
    world = people(*((cos(n * pi / 3), sin(n * pi / 3)) for n in range(6)))
    body = body_with(fault("kidnap", at=0.1, **kidnap), world=world)
    drive(body, Twist(), 0.5)
    events = {event.kind: event.text for event in body.take_events()}
    assert "no effect" in events["fault_end"] and not {"contact", "lifted"} & {*events}
    assert body.truth.pose.distance_to(ORIGIN) < 0.01


def test_the_robot_is_put_down_at_a_distance_from_people(body_with):
    world = people((0.8, 0.0), (0.8, 0.8), (0.8, -0.8), (0.0, -1.4))
    for seed in range(4):
        body = body_with(fault("kidnap", distance=1.0), world=world, seed=seed)
        drive(body, Twist(), 0.1)
        here = body.truth.pose
        assert here.distance_to(ORIGIN) == pytest.approx(1.0, abs=0.15)
        middles = [person.waypoints[0] for person in world.people]
        nearest = min(np.hypot(here.x - x, here.y - y) for x, y in middles)
        assert nearest > ROBOT.footprint.circumscribed_radius + 0.2 + 0.5 - 0.01


def test_reset_gives_the_same_run(body_with):
    faults = (fault("lidar_dropout", per_minute=0.9, lasts=0.3), fault("push", at=0.4))
    body = body_with(*faults, seed=3)

    def sensed():
        ranges = np.concatenate([scan.ranges for scan in scans(body, 2.0, Twist(0.2))])
        return ranges.tobytes(), body.truth.pose

    first = sensed()
    body.reset(3, numbered(faults))
    assert sensed() == first
