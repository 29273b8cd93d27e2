"""Escapes in a toy world: every kind of drive, noise, blind sectors, stalls and deadlines."""

from dataclasses import replace
from itertools import pairwise
from math import cos, hypot, inf, pi, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.omnidirectional import OmniWheels
from stack.errors import ParameterError
from stack.navigation.escape import kernels
from stack.navigation.escape.primitives import EscapeSegment, motions, roll_out
from stack.navigation.escape.search import EscapeSearch
from stack.navigation.escape.surroundings import Surroundings
from stack.navigation.escape.views import BeamView
from stack.types import (
    STANDSTILL,
    FailureCode,
    Footprint,
    ObstaclePoints,
    Odometry,
    Perceived,
    Pose2D,
    PoseEstimate,
    RangeReading,
    RangeView,
    Scan,
    TaskStatus,
    Twist,
)
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyWorld, robot, room

DIFFERENTIAL, ROUND = robot(), robot(Footprint.circle(0.22))
CAR = replace(robot(), wheels=SteeredWheels(("a", "b"), ("c", "d"), 0.05, 0.3, 0.25, 0.6, 2.0))
OMNI = replace(robot(lateral_speed=0.4), wheels=OmniWheels((), (), 0.05))
MIDDLE = Pose2D(3.0, 3.0)


def box(x, y, length, width):
    a, b, c, d = x - length / 2, x + length / 2, y - width / 2, y + width / 2
    return [(a, c, b, c), (b, c, b, d), (b, d, a, d), (a, d, a, c)]


def wedge(who, gap, free=()):
    """Crates round MIDDLE at this gap to the outline, but for the free sides."""
    half_length, half_width = who.footprint.points.max(axis=0)
    across, along = half_length + gap + 0.15, half_width + gap + 0.15
    sides = {
        "ahead": (across, 0.0, 0.3, 2 * half_width), "left": (0.0, along, 2 * half_length, 0.3),
        "behind": (-across, 0.0, 0.3, 2 * half_width), "right": (0.0, -along, 2 * half_length, 0.3),
    }  # fmt: skip
    crates = []
    for name, (x, y, length, width) in sides.items():
        if name not in free:
            crates += box(MIDDLE.x + x, MIDDLE.y + y, length, width)
    return crates


def noisy(world, seed=1, deviation=0.01, blind=lambda angle: False):
    """Let the world's scans err, and show nothing (NaN) in blind directions."""
    random, see = np.random.default_rng(seed), world._see

    def look():
        see()
        scan = world.scan
        ranges = scan.ranges + random.normal(0.0, deviation, scan.ranges.size)
        ranges[[blind(angle) for angle in scan.angles]] = np.nan
        world.scan = replace(scan, ranges=ranges.astype(np.float32))

    world._see = look
    look()
    world._sense({world.lidar: world.scan})
    return world


@pytest.mark.parametrize(
    ("who", "free"),
    [
        (DIFFERENTIAL, "ahead"), (DIFFERENTIAL, "behind"), (ROUND, "left"), (ROUND, "behind"),
        (CAR, "ahead"), (CAR, "behind"), (OMNI, "left"), (OMNI, "right"), (OMNI, "behind"),
    ],
)  # fmt: skip
def test_five_centimetres_on_three_sides_are_enough_to_get_out(make, who, free):
    world = noisy(ToyWorld(room(6, 6) + wedge(who, 0.05, [free]), who, MIDDLE, beams=360))
    toy = make(world, lost_motions="drive")
    toy.health = 0.0  # neither the pose nor the costmap is used
    toy.local.grid.cells[:] = toy.globe.grid.cells[:] = 254
    task = toy.navigator.base.escape()
    assert toy.finish(task, 90) is TaskStatus.SUCCEEDED
    assert world.twist.stands
    assert world.clearance() > 0.12
    assert world.nearest > 0.03


@settings(deadline=None, max_examples=25)
@given(
    st.lists(
        st.tuples(st.floats(0.3, 3.7), st.floats(0.3, 3.7), st.floats(0.05, 0.25)),
        min_size=4, max_size=12,
    ),
    st.sampled_from([DIFFERENTIAL, ROUND, CAR, OMNI]), st.floats(-pi, pi),
)  # fmt: skip
def test_wherever_it_stands_it_ends_and_touches_nothing(circles, who, heading):
    world = ToyWorld(room(4, 4), who, Pose2D(2.0, 2.0, heading), circles=circles, beams=360)
    assume(world.clearance() > 0.01)
    assume(all(hypot(x - 2.0, y - 2.0) > 0.25 + r for x, y, r in circles))
    toy = ToyDrive(world)
    task = toy.navigator.base.escape()
    toy.finish(task, 120)
    toy.navigator.close()
    assert task.status is not TaskStatus.RUNNING
    assert world.nearest > 0.0
    if task.status is TaskStatus.FAILED:
        assert task.failure.code in (FailureCode.COLLISION_AHEAD, FailureCode.NO_PROGRESS)


@pytest.mark.parametrize("who", [DIFFERENTIAL, ROUND, CAR, OMNI])
def test_shut_in_it_fails_once_patience_is_over(make, who):
    toy = make(ToyWorld(room(6, 6) + wedge(who, 0.03), who, MIDDLE, beams=360))
    task = toy.navigator.base.escape()
    toy.finish(task)
    assert task.failure.code == FailureCode.COLLISION_AHEAD
    assert "obstacles block every motion" in task.failure.sentence
    assert toy.world.time < 3.0  # recovery_patience is 2 s
    assert toy.world.pose == MIDDLE


def test_it_leaves_when_a_person_steps_aside_in_time(make):
    world = ToyWorld(room(6, 6) + wedge(ROUND, 0.05, ["behind"]), ROUND, MIDDLE, beams=360)
    world.circles.append((2.55, 3.0, 0.2))
    toy = make(world)
    task = toy.navigator.base.escape()
    toy.run(1.0)
    world.circles.clear()
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def test_it_fails_when_no_pose_has_more_clearance(make):
    toy = make(ToyWorld(room(1.5, 1.5), ROUND, Pose2D(0.75, 0.75), beams=360))
    task = toy.navigator.base.escape(clearance=1.0)
    toy.finish(task)
    assert task.failure.code == FailureCode.NO_PROGRESS
    assert "more clearance than the 0.5" in task.failure.sentence  # 0.75 m less the radius


def test_it_goes_no_farther_than_allowed(make):
    lane = [(0, 2.7, 6, 2.7), (0, 3.3, 6, 3.3)]  # 0.6 m wide, and far to its end
    wall = box(3.4, 3.0, 0.2, 0.5)
    toy = make(ToyWorld(room(6, 6) + lane + wall, ROUND, MIDDLE, beams=360))
    task = toy.navigator.base.escape(distance=0.4)
    toy.finish(task)
    assert toy.distance < 0.45


def test_enough_room_is_a_success_at_once(make):
    toy = make(ToyWorld(room(6, 6), ROUND, MIDDLE))
    assert toy.finish(toy.navigator.base.escape()) is TaskStatus.SUCCEEDED
    assert toy.world.pose == MIDDLE


def test_a_stalled_robot_gives_up(make):
    toy = make(ToyWorld(room(6, 6) + wedge(ROUND, 0.05, ["left"]), ROUND, MIDDLE, beams=360))
    drive = toy.world.drive
    toy.world.drive = lambda twist: drive(STANDSTILL)
    task = toy.navigator.base.escape()
    toy.finish(task)
    assert task.failure.code == FailureCode.NO_PROGRESS
    assert toy.world.time == pytest.approx(3.0, abs=0.3)


def test_a_robot_that_crawls_runs_out_of_time(make):
    toy = make(ToyWorld(room(6, 6) + wedge(ROUND, 0.05, ["behind"]), ROUND, MIDDLE, beams=360))
    drive = toy.world.drive
    toy.world.drive = lambda twist: drive(Twist(0.06 * twist.linear, 0.06 * twist.angular))
    task = toy.navigator.base.escape(distance=0.5)
    toy.finish(task, 300)
    assert task.failure.code == FailureCode.TIMED_OUT
    # three times 0.5 m at 0.15 m/s and two turns at 1 rad/s, and 5 s
    assert toy.world.time == pytest.approx(3 * (0.5 / 0.15 + 4 * pi) + 5, abs=0.3)


def test_without_a_sensor_it_says_what_is_missing(make):
    toy = make(ToyWorld(room(6, 6), robot(lidar=False), MIDDLE))
    task = toy.navigator.base.escape()
    toy.finish(task)
    assert task.failure.code == FailureCode.FAILED
    assert "an escape needs a lidar or a sonar" in task.failure.sentence


def test_a_direction_never_seen_is_not_free(make):
    who = DIFFERENTIAL
    world = ToyWorld(room(6, 6) + wedge(who, 0.05, ["behind"]), who, MIDDLE, beams=360)
    toy = make(noisy(world, deviation=0.0, blind=lambda angle: cos(angle) < cos(2.4)))
    task = toy.navigator.base.escape()
    toy.finish(task)
    assert task.failure.code == FailureCode.COLLISION_AHEAD
    assert world.pose == MIDDLE


def test_the_way_just_driven_is_free_though_unseen(make):
    who = DIFFERENTIAL
    world = ToyWorld(
        room(6, 6) + wedge(who, 0.05, ["behind"]), who, Pose2D(2.0, 3.0), beams=360
    )  # fmt: skip
    toy = make(noisy(world, deviation=0.0, blind=lambda angle: cos(angle) < cos(2.4)))
    toy.navigator.base.drive_for(Twist(0.25), 3.7)
    toy.run(5.0)
    assert world.pose.x > 2.85
    assert world.clearance() < 0.08
    assert toy.finish(toy.navigator.base.escape()) is TaskStatus.SUCCEEDED
    assert world.nearest > 0.02


def test_escapes_by_nothing_are_refused(make):
    with pytest.raises(ParameterError, match="clearance: 0 must be above 0"):
        make().navigator.base.escape(clearance=0.0)


def test_motions_keep_to_what_the_drive_can_do():
    for legs in motions(CAR, 1.5):
        for leg in legs:
            assert leg.twist.lateral == 0.0
            assert abs(leg.twist.angular) * CAR.turning_radius <= abs(leg.twist.linear) + 1e-9
    assert all(leg.twist.lateral == 0.0 for legs in motions(DIFFERENTIAL, 1.5) for leg in legs)
    forward_only = robot(reverse_speed=0.0)
    assert all(leg.twist.linear >= 0.0 for legs in motions(forward_only, 1.5) for leg in legs)


def written(legs):
    """Legs in figures that compare: forward, turning, sideways, amount; nothing is minus zero."""
    return tuple(
        tuple(
            round(value, 9) + 0.0
            for value in (leg.twist.linear, leg.twist.angular, leg.twist.lateral, leg.amount)
        )
        for leg in legs
    )


@pytest.mark.parametrize("fine", [False, True])
@pytest.mark.parametrize("who", [DIFFERENTIAL, ROUND, CAR, OMNI, robot(reverse_speed=0.0)])
def test_every_motion_has_its_mirror_image(who, fine):
    found = {written(legs) for legs in motions(who, 1.5, fine)}
    mirrored = {
        tuple((x, -turn + 0.0, -y + 0.0, amount) for x, turn, y, amount in legs) for legs in found
    }
    assert found == mirrored


@pytest.mark.parametrize("who", [DIFFERENTIAL, CAR, OMNI])
def test_legs_are_driven_with_one_metre_or_one_radian_per_unit(who):
    for legs in [*motions(who, 1.5), *motions(who, 1.5, fine=True)]:
        for leg in legs:
            speed = hypot(leg.twist.linear, leg.twist.lateral)
            assert abs(leg.twist.angular if leg.turns else speed) == pytest.approx(1.0)
            assert 0.0 < leg.amount <= max(1.5, pi)


@pytest.mark.parametrize(
    ("leg", "speed", "acceleration"),
    [
        (
            EscapeSegment(Twist(angular=-1.0), 0.8),
            0.6,
            1.0,
        ),  # limited by 0.6 rad/s
        (EscapeSegment(Twist(1.0), 0.8), 0.15, 0.4),
        (EscapeSegment(Twist(-1.0, 3.0), 0.8), 0.15, 0.4),
        (EscapeSegment(Twist(1.0, 8.0), 0.8), 0.6 / 8.0, 0.4),  # 8 rad/m at no more than 0.6 rad/s
    ],
)
def test_legs_speed_up_by_half_of_what_the_drive_can(make, leg, speed, acceleration):
    who = robot(angular_speed=0.6, angular_acceleration=2.0, linear_acceleration=0.8)
    toy = make(ToyWorld(room(6, 6), who, MIDDLE))
    toy.navigator.base.escape()
    profile = toy.navigator.activities.current._profile(leg)
    assert (profile.total, profile.speed, profile.acceleration) == pytest.approx(
        (0.8, speed, acceleration)
    )


CROSS = np.array([[1.0, 2.0, 3.0, 4.0]])
"""Metres that beams ahead, left, behind and right reach."""


def known(point, ranges=CROSS, increment=pi / 2, trail=(), view=(0.0, 0.0, 0.0), angle_min=0.0):
    """Whether a point is known ground for a robot of 0.4 m by 0.2 m."""
    corners = np.array([[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]])
    views = np.array([[*view, angle_min, increment, ranges.shape[1]]])
    return kernels.known_until(
        np.zeros((1, 3)), np.array([point]), views, ranges,
        np.array(trail, dtype=float).reshape(-1, 3), corners,
    ) == 1  # fmt: skip


@pytest.mark.parametrize(
    ("bearing", "reach"), [(pi / 4, 1.0), (3 * pi / 4, 2.0), (-3 * pi / 4, 3.0), (-pi / 4, 1.0)]
)
def test_ground_between_two_beams_is_known_as_far_as_the_shorter_one(bearing, reach):
    for distance, expected in ((reach - 0.01, True), (reach + 0.01, False)):
        point = (distance * cos(bearing), distance * sin(bearing))
        assert known(point) is expected


def test_ground_beside_the_field_of_view_is_not_known():
    quarter = CROSS[:, :3]  # beams at 0, 45 and 90 degrees
    for point, expected in [
        ((0.5, 0.1), True), ((0.1, 0.5), True), ((0.5, -0.1), False), ((-0.1, 0.5), False),
        ((-0.5, -0.1), False),
    ]:  # fmt: skip
        assert known(point, quarter, increment=pi / 4) is expected


def test_ground_behind_an_invalid_beam_is_not_known():
    assert not known((0.5, 0.5), np.array([[np.nan, 2.0, 3.0, 4.0]]))
    assert not known((0.5, 0.5), np.array([[1.0, np.nan, 3.0, 4.0]]))


def test_a_lidar_looks_from_where_it_is_mounted():
    """It stands at (1, 2), beam 0 looks along y + 90 deg = -x, so -x reaches 1 m, -y 2 m."""
    view, angle_min = (1.0, 2.0, pi / 4), 3 * pi / 4
    for step, expected in ((0.65, True), (0.75, False)):  # 0.92 and 1.06 m at 45 deg
        point = (1.0 - step, 2.0 - step)
        assert known(point, view=view, angle_min=angle_min) is expected


def test_ground_is_known_where_the_outline_has_stood():
    nothing = np.zeros((1, 4))
    trail = [(1.0, 2.0, pi / 2), (5.0, 5.0, 0.0)]
    for point, expected in [
        ((0.95, 2.15), True), ((0.85, 2.15), False), ((1.05, 1.85), True), ((1.05, 1.75), False),
        ((5.15, 5.05), True), ((5.15, 5.15), False), ((4.75, 5.05), False),
    ]:  # fmt: skip
        assert known(point, nothing, trail=trail) is expected


@pytest.mark.parametrize("who", [DIFFERENTIAL, CAR, OMNI])
def test_rollouts_are_dense_and_end_where_the_segments_do(who):
    radius = who.footprint.circumscribed_radius
    for legs in motions(who, 0.8):
        rollout = roll_out(MIDDLE, legs, radius)
        poses = [MIDDLE, *(Pose2D(*pose) for pose in rollout.poses)]
        for before, after in pairwise(poses):
            rim = before.distance_to(after) + radius * abs(after.heading - before.heading)
            assert rim < 0.0201
        driven = sum(leg.amount for leg in legs if not leg.turns)
        turned = sum(leg.amount for leg in legs if leg.turns)
        assert (rollout.length[-1], rollout.turned[-1]) == pytest.approx((driven, turned))
        assert rollout.amount[-1] == pytest.approx(legs[-1].amount)
        assert rollout.segment[-1] == len(legs) - 1
        pose = MIDDLE
        for leg in legs:  # the closed form of an arc, by many small steps
            for _ in range(400):
                step = leg.amount / 400
                turn = leg.twist.angular * step
                c, s = cos(turn / 2), sin(turn / 2)
                dx, dy = leg.twist.linear * step, leg.twist.lateral * step
                pose = pose.compose(Pose2D(c * dx - s * dy, s * dx + c * dy, turn))
        assert pose.distance_to(poses[-1]) < 1e-6


def looked(surroundings, ranges, pose=Pose2D(0.0, 0.0), time=0.0):
    """A scan of four beams: ahead, left, behind, right."""
    scan = Scan(time, np.array(ranges, dtype=np.float32), 0.0, pi / 2, 0.05, 10.0)
    look(surroundings, pose, lidar=scan)


def look(surroundings, pose, **measured):
    """Measurements of some sensors, all taken at a pose."""
    estimate, odometry = PoseEstimate(pose, np.eye(3), 1.0), Odometry(0.0, pose, STANDSTILL)
    views = {name: RangeView(pose, measurement) for name, measurement in measured.items()}
    surroundings.look(Perceived(0.0, estimate, odometry, ObstaclePoints(views=views)))


def points(surroundings, pose=Pose2D(0.0, 0.0)):
    return sorted(tuple(map(float, np.round(p, 6))) for p in surroundings.points(pose, 20.0))


def test_an_invalid_beam_of_a_standing_robot_is_filled_from_before():
    surroundings = Surroundings()
    looked(surroundings, [1.0, 2.0, 3.0, 4.0])
    looked(surroundings, [1.1, np.nan, 3.0, np.inf], time=0.1)
    assert points(surroundings) == [(-3.0, 0.0), (0.0, 2.0), (1.1, 0.0)]


def test_what_a_newer_scan_sees_through_is_forgotten_and_what_it_cannot_see_is_kept():
    surroundings = Surroundings()
    looked(surroundings, [5.0, 2.0, 3.0, 4.0])
    looked(surroundings, [4.5, np.nan, 8.0, 1.0], Pose2D(0.5, 0.0), time=1.0)
    # ahead: confirmed at x = 5; left: not seen again; behind: gone, now 8 m; right: hidden behind
    # what stands 1 m away, if the beam of old leads there: it does, 3 deg aside at 4 m.
    assert points(surroundings) == [
        (-7.5, 0.0), (0.0, -4.0), (0.0, 2.0), (0.5, -1.0), (5.0, 0.0),
    ]  # fmt: skip


HERE = Pose2D(0.0, 0.0)


def reading(distance, yaw=0.0):
    return RangeReading(0.0, distance, 0.44, 0.05, 2.5, Pose2D(0.0, 0.0, yaw))


def test_a_newer_scan_clears_old_arcs_of_a_sonar_but_not_its_newest():
    """A lidar may look over what a sonar sees; the arc of an old reading is only a guess."""
    surroundings = Surroundings()
    scan = Scan(0.0, np.full(8, 5.0, np.float32), 0.0, pi / 4, 0.05, 10.0)
    look(surroundings, HERE, sonar=reading(1.0))
    look(surroundings, HERE, lidar=scan)
    assert np.hypot(*surroundings.points(HERE, 1.1).T) == pytest.approx(1.0)
    look(surroundings, Pose2D(0.0, 0.0, pi), sonar=reading(inf))
    assert not len(surroundings.points(HERE, 1.1))


def test_what_a_second_lidar_sees_counts_and_is_kept_when_the_robot_turns_away():
    surroundings = Surroundings()
    ahead = Scan(0.0, np.full(181, 3.0, np.float32), -pi / 2, pi / 180, 0.05, 10.0)
    behind = replace(ahead, ranges=np.full(181, 1.0, np.float32), mount=Pose2D(0.0, 0.0, pi))
    look(surroundings, HERE, front=ahead, rear=behind)
    assert np.hypot(*surroundings.points(HERE, 5.0).T).min() == pytest.approx(1.0)
    look(surroundings, Pose2D(0.0, 0.0, pi), front=replace(ahead))  # looks where `rear` did
    assert np.hypot(*surroundings.points(HERE, 5.0).T).min() == pytest.approx(1.0)
    look(surroundings, Pose2D(0.0, 0.0, pi), rear=replace(ahead, mount=Pose2D(0.0, 0.0, pi)))
    assert np.hypot(*surroundings.points(HERE, 5.0).T) == pytest.approx(3.0)


def test_the_cone_of_a_sonar_is_known_ground_up_to_its_reading():
    search = EscapeSearch(
        replace(ROUND, footprint=Footprint.circle(0.05)), surroundings := Surroundings()
    )
    look(surroundings, HERE, left=reading(1.0, yaw=pi / 2))
    straight = np.column_stack([np.zeros(20), np.linspace(0.3, 2.2, 20), np.zeros(20)])
    # the outline is 5 cm, a beam ends 3 cm later than measured: the pose at 0.9 m is the last one
    assert search._known_until(straight) == 7
    look(surroundings, HERE, left=reading(inf, yaw=pi / 2))
    assert search._known_until(straight) == 20
    assert search._known_until(straight[:, [1, 0, 2]]) == 0


def test_a_deskewed_scan_is_seen_along_its_true_bearings():
    """Beams every 90 degrees of a lidar that turned by 5 degrees per beam: 85 degrees apart."""
    bearings = np.radians([-85.0, 0.0, 85.0])
    scan = Scan(
        0.0, np.array([2.0, 1.0, 3.0], np.float32), -pi / 2, pi / 2, 0.05, 10.0, bearings=bearings
    )
    view = BeamView.of(RangeView(HERE, scan))
    assert view.ranges == pytest.approx([2.0, 1.0, 3.0])
    shifted = replace(scan, bearings=np.radians([10.0, 90.0, 170.0]))
    view = BeamView.of(RangeView(HERE, shifted))
    assert np.isnan(view.ranges).tolist() == [False, False, False]
    # -90 is 100 deg from the beam at 10 and from the one at 170: nearer than 1.5 increments
    assert view.ranges[1:] == pytest.approx([2.0, 1.0])
