from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.drivetrain.differential import Wheels
from stack.errors import BodyError
from stack.sim.physics.pybullet_engine.engine import BulletEngine
from stack.sim.worlds.world import Box
from stack.types import Pose2D
from tests.stack.sim.sim_rover import EMPTY, ROVER


@pytest.fixture
def build():
    made = []

    def make(description=ROVER, world=EMPTY, start=Pose2D(0.0, 0.0)):
        made.append(BulletEngine(world))
        return made[-1], made[-1].add_robot(description, start)

    yield make
    for physics in made:
        physics.close()


def centre_of_mass(physics):
    import pybullet

    return pybullet.getBasePositionAndOrientation(physics.body, physicsClientId=physics.client)[0]


def test_the_pose_is_the_base_frames_and_not_the_centre_of_mass(build):
    _, physics = build(start=Pose2D(3.0, -1.0, pi / 2))
    truth = physics.truth()
    assert (truth.pose.x, truth.pose.y) == pytest.approx((3.0, -1.0), abs=1e-6)
    assert truth.pose.heading == pytest.approx(pi / 2, abs=1e-6)
    # The base link's mass is 0.05 m before and 0.1 m above the base frame (rover.urdf).
    assert centre_of_mass(physics) == pytest.approx((3.0, -0.95, 0.1), abs=1e-6)


def test_spinning_moves_the_centre_of_mass_and_not_the_base(build):
    engine, physics = build()
    physics.set_wheel_speeds(-2.0, 2.0)  # 2 rad/s x 0.08 m / 0.16 m = 1 rad/s
    for _ in range(500):
        engine.step()
    twist = physics.truth().twist
    assert twist.angular == pytest.approx(1.0, rel=0.01)
    assert abs(twist.linear) < 0.005
    assert abs(twist.lateral) < 0.005
    assert np.hypot(*physics.truth().pose.transform(np.zeros((1, 2)))[0]) < 0.01


def test_wheels_and_casters_share_the_weight(build):
    engine, physics = build()
    for _ in range(500):
        engine.step()
    truth = physics.truth()
    assert np.hypot(truth.pose.x, truth.pose.y) < 1e-3
    assert physics.base_state().rotation[8] > 1.0 - 1e-4  # within 0.8 degrees of upright
    import pybullet

    floor = engine.scene.floor
    contacts = pybullet.getContactPoints(physics.body, floor, physicsClientId=physics.client)
    load = {point[3]: point[9] for point in contacts}
    # Balance of moments about the wheels' axis: base 12 kg 0.05 m ahead on the front caster
    # 0.15 m ahead takes 12 * 9.81 * 0.05 / 0.15 = 39.2 N; all weigh 13.2 * 9.81 = 129.5 N.
    assert load[physics.joints[0]] + load[physics.joints[1]] == pytest.approx(90.2, rel=0.02)


def test_a_parked_robot_does_not_creep(build):
    engine, physics = build()
    physics.set_wheel_speeds(5.0, 6.0)
    for _ in range(200):
        engine.step()
    physics.set_wheel_speeds(0.0, 0.0)
    for _ in range(500):
        engine.step()
    before = physics.truth().pose
    for _ in range(1000):
        engine.step()
    after = physics.truth().pose
    # Two seconds; with the wheels' speed held at nothing it was 0.25 mm and 4e-4 rad.
    assert before.distance_to(after) < 1e-6
    assert abs(after.heading - before.heading) < 1e-6


def test_a_robot_put_elsewhere_comes_to_rest_without_a_bounce(build):
    engine, physics = build()
    physics.set_wheel_speeds(6.0, 6.0)
    for _ in range(500):
        engine.step()
    physics.place(Pose2D(-4.0, 2.0, 1.0))
    heights = []
    for _ in range(250):
        engine.step()
        heights.append(physics.base_state().position[2])
    truth = physics.truth()
    assert (truth.pose.x, truth.pose.y) == pytest.approx((-4.0, 2.0), abs=2e-3)
    assert truth.pose.heading == pytest.approx(1.0, abs=2e-3)
    assert np.abs(heights).max() < 1e-3


def test_distance_to_the_nearest_thing_but_the_floor(build):
    boxes = (Box(Pose2D(0.9, 0.0), (0.6, 1.0, 0.5)), Box(Pose2D(5.0, 0.0), (1.0, 1.0, 1.0)))
    engine, physics = build(world=replace(EMPTY, boxes=boxes))
    engine.step()
    # The box begins at 0.6, the hull ends at 0.18, both casters and wheels earlier.
    assert physics.distance(1.0) == pytest.approx(0.42, abs=2e-3)
    assert physics.distance(0.3) == 0.3
    assert physics.touching() == []


def test_touching_names_the_thing_and_the_place(build):
    engine, physics = build(world=replace(EMPTY, boxes=(Box(Pose2D(0.42, 0.0), (0.5, 1.0, 0.5)),)))
    engine.step()
    touch = physics.touching()[0]
    assert touch.name == "a static obstacle"
    assert touch.place[0] == pytest.approx(0.17, abs=0.02)
    assert touch.depth == pytest.approx(0.01, abs=0.002)  # from 0.17 to the hull's end at 0.18


def test_two_worlds_in_one_process_do_not_mix(build):
    (first, one), (second, other) = build(), build(start=Pose2D(5.0, 5.0))
    one.set_wheel_speeds(5.0, 5.0)
    for _ in range(200):
        first.step()
        second.step()
    assert one.truth().pose.x > 0.1
    assert other.truth().pose.x == pytest.approx(5.0, abs=1e-3)


def test_an_unknown_wheel_joint_is_refused(build):
    wrong = replace(ROVER, wheels=Wheels(("left_wheel",), ("right_wheel_joint",), 0.08, 0.32))
    with pytest.raises(
        BodyError, match=r"no wheel joint 'left_wheel'; its joints are .*left_wheel_joint"
    ):
        build(wrong)


def test_a_broken_shape_is_refused(build):
    for text in ("", "<robot", '<robot name="r"/>'):
        with pytest.raises(BodyError, match="the robot's URDF cannot be loaded by PyBullet"):
            build(replace(ROVER, model=text))
