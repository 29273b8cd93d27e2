"""The simulation with another physics engine: nothing of it is left that needs PyBullet."""

from dataclasses import replace

import pytest

import missions
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.sim.simulation import Simulation
from stack.sim.worlds.world import Push, Trigger, WorldEvent
from stack.types import Image, Pose2D, Twist
from tests.stack.sim.kinematic_engine import KinematicEngine
from tests.stack.sim.sim_rover import CAMERA, EMPTY, EQUIPPED, ROVER, drive, square_room


@pytest.fixture
def body_in():
    made = []

    def make(world, description=ROVER, start=Pose2D(0.0, 0.0)):
        made.append(Simulation(world, KinematicEngine))
        return SimulatedBody(description, world, start=start, seed=1, simulation=made[-1])

    yield make
    for simulation in made:
        simulation.close()


def test_a_mission_drives_to_its_goal_in_another_engine(body_in):
    bodies = []

    def make(setup):
        bodies.append(body_in(setup.world, setup.robot, setup.start))
        return bodies[0]

    report = missions.run("01_drive_to_a_point", seed=1, body=make)
    assert report.status == "success"
    # The goal of the mission is (5.0, 3.8) within the 0.25 m and the error of the localisation.
    assert bodies[0].truth.pose.distance_to(Pose2D(5.0, 3.8)) < 0.3


def test_the_wheels_of_the_engine_are_what_moves_the_robot(body_in):
    body = body_in(EMPTY)
    drive(body, Twist(0.3), 4.0)
    # 0.3 m/s after a ramp of 0.3 / a seconds, which costs half of that way.
    ramp = 0.3 / ROVER.limits.linear_acceleration
    assert body.truth.pose.x == pytest.approx(0.3 * (4.0 - ramp / 2.0), abs=0.01)
    assert body.sense().wheels.twist.linear == pytest.approx(0.3, abs=0.02)


def test_range_sensors_imu_and_pushes_work_in_another_engine(body_in):
    push = WorldEvent(Trigger(0.5), push=Push(Pose2D(0.4, 0.0)))
    body = body_in(square_room(3.0, timeline=(push,)), replace(EQUIPPED, camera=None))
    seen = drive(body, Twist(), 2.0)
    assert body.truth.pose.x == pytest.approx(0.4, abs=1e-3)
    ahead = [
        scan.ranges[scan.ranges.size // 2]
        for scan in (o.measurements["lidar"] for o in seen if "lidar" in o.measurements)
    ]
    # The lidar is 0.1 m ahead of the base: 2.9 m from the wall, then 2.5 m, with 1 cm of noise.
    assert (ahead[0], ahead[-1]) == pytest.approx((2.9, 2.5), abs=0.05)
    assert all(
        o.imu.linear_acceleration[:, 2].mean() == pytest.approx(9.81, abs=0.2)
        for o in seen
        if o.imu
    )


def test_pictures_are_those_of_the_engine(body_in):
    body = body_in(EMPTY, replace(ROVER, camera=replace(CAMERA, noise=0.0)))
    body.command(BodyCommand(capture=True))
    body.wait(0.5)
    picture = body.sense().named("camera", Image)
    assert (picture.pixels == 128).all()  # of `GreyRenderer`, in the camera's own process
