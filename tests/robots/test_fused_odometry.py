"""Odometry in the simulation: pushes, ice, a wall, the gyro's bias."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import pytest

import missions
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.localisation.fusion.ekf import EkfOdometry
from stack.localisation.fusion.parameters import EkfParameters
from stack.localisation.fusion.wheels_gyro import WheelGyroOdometry
from stack.localisation.parameters import OdometryFusionParameters
from stack.sim.worlds.world import Box, FrictionZone, Push, Trigger, World, WorldEvent
from stack.types import Odometry, Pose2D, Twist, wrap_angle
from tests.stack.sim.sim_rover import EQUIPPED, square_room

ROBOT = replace(EQUIPPED, camera=None)
CLUTTER = (
    Box(Pose2D(2.5, 2.0), (0.6, 0.4, 1.0)),
    Box(Pose2D(-1.5, 2.8, 0.4), (1.0, 0.5, 1.0)),
    Box(Pose2D(-2.8, -1.9), (0.4, 1.2, 1.0)),
    Box(Pose2D(1.6, -2.6, 0.9), (0.8, 0.8, 1.0)),
)
ROOM = replace(square_room(4.0), boxes=CLUTTER)


class Drive:
    """A drive from the middle of the room with both odometries beside the truth."""

    def __init__(self, world: World, seed: int = 1) -> None:
        self.body = SimulatedBody(ROBOT, world, start=Pose2D(0.0, 0.0), seed=seed)
        self.ekf = EkfOdometry(EkfParameters(), ROBOT)
        self.plain = WheelGyroOdometry(OdometryFusionParameters(), ROBOT)
        self.fused: list[Odometry] = []
        self.wheels_alone = Pose2D(0.0, 0.0)

    def go(self, twist: Twist, seconds: float) -> Drive:
        for _ in range(round(seconds / 0.05)):
            observation = self.body.sense()
            self.fused.append(self.ekf.update(observation))
            self.wheels_alone = self.plain.update(observation).pose
            self.truth = self.body.truth.pose
            self.body.command(BodyCommand(twist))
            self.body.wait(0.05)
        return self

    def error(self, pose: Pose2D | None = None) -> tuple[float, float]:
        """Distance, metres, and angle, radians, from the truth."""
        pose = pose or self.fused[-1].pose
        return pose.distance_to(self.truth), abs(wrap_angle(pose.heading - self.truth.heading))


@pytest.fixture
def start():
    made: list[Drive] = []

    def begin(world: World, seed: int = 1) -> Drive:
        made.append(Drive(world, seed))
        return made[-1]

    yield begin
    for drive in made:
        drive.body.close()


def pushed(by: Pose2D, over: float) -> World:
    return replace(ROOM, timeline=(WorldEvent(Trigger(time=1.0), push=Push(by, over)),))


@pytest.mark.parametrize("twist", [Twist(), Twist(0.3, 0.3)], ids=["standing", "driving"])
@pytest.mark.parametrize(
    ("by", "over"),
    [
        (Pose2D(0.1, 0.0), 1.0),
        (Pose2D(0.3, 0.2, radians(30)), 0.3),
        (Pose2D(0.9, -0.8, radians(-50)), 0.6),
        (Pose2D(-1.4, 1.2, radians(60)), 1.0),
        (Pose2D(0.5, 0.0), 0.1),
    ],
    ids=["slow", "knock", "shove", "carry", "jolt"],
)
def test_after_a_push_the_odometry_is_right_to_centimetres(start, by, over, twist):
    drive = start(pushed(by, over)).go(twist, 1.0)
    assert not drive.fused[-1].disturbed
    drive.go(twist, over + 0.1).go(Twist(), 1.2)
    distance, angle = drive.error()
    assert distance < 0.03 and angle < radians(1.5)
    off, _ = drive.error(drive.wheels_alone)
    assert off > 0.7 * Pose2D(0.0, 0.0).distance_to(by)  # wheels and gyro alone miss the push
    assert any(odometry.disturbed for odometry in drive.fused)
    assert not drive.fused[-1].disturbed  # and the wheels are used again


def test_a_push_is_in_the_stated_covariance(start):
    """The sum of the steps' variances covers what the wheels did not measure."""
    drive = start(pushed(Pose2D(0.9, -0.8, radians(-50)), 0.6)).go(Twist(), 3.0)
    before = sum(odometry.step_covariance[0, 0] for odometry in drive.fused[:19])
    during = sum(odometry.step_covariance[0, 0] for odometry in drive.fused[19:])
    assert before < 1e-5  # standing
    assert during > drive.error()[0] ** 2
    assert during > 0.03**2


def test_wheels_that_spin_on_ice_do_not_move_the_odometry(start):
    """µ = 0.02: the body speeds up with at most 0.2 m/s², the wheels with 1 m/s²."""
    ice = FrictionZone((-4.0, -4.0, 4.0, 4.0), 0.02)
    drive = start(replace(ROOM, friction_zones=(ice,))).go(Twist(), 0.5)
    for twist in (Twist(0.6), Twist(), Twist(-0.3), Twist(0.0, 1.0)):
        drive.go(twist, 1.5)
    drive.go(Twist(), 1.0)
    assert drive.error()[0] < 0.03
    assert drive.error(drive.wheels_alone)[0] > 0.15
    assert any(odometry.disturbed for odometry in drive.fused)


def test_wheels_that_turn_against_a_wall_do_not_move_the_odometry(start):
    wall = Box(Pose2D(0.6, 0.0), (0.2, 1.5, 1.0))
    drive = start(replace(ROOM, boxes=(*CLUTTER, wall), friction=0.3)).go(Twist(), 0.5)
    drive.go(Twist(0.3), 5.0).go(Twist(), 1.0)
    assert drive.error(drive.wheels_alone)[0] > 0.4
    assert drive.error()[0] < 0.05


def test_undisturbed_drives_are_better_than_wheels_and_gyro_and_learn_the_bias(start):
    """No standstill at the start: the gyro's bias is learnt on the way, from the scans."""
    for seed in (2, 3):
        drive = start(ROOM, seed)
        drive.go(Twist(0.3, 0.6), 10.5).go(Twist(0.3, -0.6), 10.5)  # a figure of eight
        distance, angle = drive.error()
        assert distance < 0.04 and angle < radians(0.8)
        plain, turned = drive.error(drive.wheels_alone)
        assert (plain, turned) > (distance, angle)
        bias = float(drive.body._robot._imu._bias[2])
        assert drive.ekf.gyro_bias == pytest.approx(bias, abs=0.001)
        assert not any(odometry.disturbed for odometry in drive.fused)


MISSION = """\
mission: pushed without a map
robot: scout
world: {folder}/store.yaml
start: [0.0, 0.0, 0]
map: none
run:
  sequence:
    - wait: 1 s
    - navigate_to_pose: {{goal: [1.5, 1.0, 0]}}
    - navigate_to_pose: {{goal: [-1.2, -0.8, 0]}}
"""
STORE = """\
world: store
bounds: [-4, -4, 4, 4]
walls:
  - {points: [[-3, -3], [3, -3], [3, 3], [-3, 3]], closed: true}
boxes:
  - {name: shelf, at: [2.6, -1.0], size: [0.5, 1.2, 1.0]}
  - {name: crate, at: [-1.0, 2.4, 0.3], size: [0.8, 0.6, 1.0]}
timeline:
  - {when: {time: 2.5 s}, push: {by: [-0.5, 0.5, 40 deg], over: 0.5 s}}
"""


def test_without_a_map_a_goal_after_a_push_is_reached_where_it_is(tmp_path):
    (tmp_path / "store.yaml").write_text(STORE, "utf-8")
    mission = tmp_path / "m.yaml"
    mission.write_text(MISSION.format(folder=tmp_path), "utf-8")
    report = missions.run(mission, seed=1, parameters={"odometry.use": "ekf"})
    assert report.status == "success"
    trail = report.localisation_error
    assert trail is not None and trail["mean"] < 0.05
