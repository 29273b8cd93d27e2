"""A simulated robot that differs from its description, as a real one does."""

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest

import robots
from missions.execution.resources import load_world
from robots.load import find_robot, read_robot
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.errors import InputError
from stack.types import DepthImage, Pose2D, Scan, Twist
from tests.stack.sim.arm_world import PANDA, TOP, bench

HERE = Path(__file__).parent
SCOUT = read_robot(find_robot("scout", HERE))


def test_wheels_and_lidar_are_those_of_the_actual_robot_and_the_measurements_as_described():
    """Radii described 10 % too large: the robot drives 10 % less than commanded and measured."""
    actual = replace(SCOUT, odometry=replace(SCOUT.odometry, slip=0.0, scale_error=0.0))
    wheels = actual.wheels.calibrated([0.0825, 0.0825], 0.29)
    turned = replace(actual.lidar, mount=Pose2D(0.0, 0.0, pi))
    described = replace(actual, wheels=wheels, lidar=turned, actual=actual)
    world = load_world("test_floor", HERE)
    body = SimulatedBody(described, world, start=world.start, seed=1)
    scan = None
    for _ in range(80):
        scan = body.sense().named("lidar", Scan) or scan
        body.command(BodyCommand(Twist(0.4)))
        body.wait(0.05)
    driven = body.truth.pose.distance_to(world.start)
    measured = body.sense().wheels.pose.x
    body.close()
    assert driven == pytest.approx(measured / 1.1, rel=0.01)
    assert scan.mount == Pose2D(0.0, 0.0, pi)


def test_pictures_are_taken_where_the_cameras_are_and_say_where_they_are_described():
    """A camera that looks straight down is 3 cm lower than described."""
    overhead = PANDA.depth_cameras["overhead"]
    down, described = (
        replace(overhead, model=replace(overhead.model, position=(0.6, 0.0, z), pitch=pi / 2))
        for z in (1.5, 1.53)
    )
    actual = replace(PANDA, depth_cameras={"overhead": down})
    robot = replace(PANDA, depth_cameras={"overhead": described}, actual=actual)
    body, picture = SimulatedBody(robot, bench(), start=Pose2D(0.0, 0.0), seed=1), None
    for _ in range(10):
        body.command(BodyCommand(depth=True))
        body.wait(0.05)
        picture = body.sense().named("overhead", DepthImage) or picture
    body.close()
    assert picture.camera.position == (0.6, 0.0, 1.53)
    assert np.median(picture.depth[110:130, 150:170]) == pytest.approx(1.5 - TOP, abs=2e-3)


@pytest.mark.parametrize(
    ("actual", "message"),
    [
        ("glide", "actual: glide has other driven wheels"),
        ("nobody", "actual: "),
        ("./robot.yaml", "names another robot itself"),
    ],
)
def test_a_wrong_actual_robot_is_refused(tmp_path, actual, message):
    folder = Path(robots.__file__).parent / "scout"
    text = (folder / "robot.yaml").read_text()
    (tmp_path / "scout.urdf").write_text((folder / "scout.urdf").read_text())
    (tmp_path / "robot.yaml").write_text(f"actual: scout\n{text}")
    (tmp_path / "other.yaml").write_text(f"actual: {actual}\n{text}")
    with pytest.raises(InputError, match=message):
        read_robot(tmp_path / "other.yaml")
