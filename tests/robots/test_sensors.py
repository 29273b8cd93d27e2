"""More than one lidar, and sonars: from the robot file to the observation and the wheels."""

import re
from dataclasses import replace
from math import pi

import numpy as np
import pytest

import missions
from missions.execution.resources import find_mission
from robots.load import find_robot, read_robot
from robots.simulated import SimulatedBody
from stack.drivetrain.description import LidarDescription
from stack.errors import InputError
from stack.safety.parameters import SafetyParameters
from stack.types import STANDSTILL, Pose2D, RangeReading, Scan, Twist
from tests.stack.safety.obstacles import SafetyStage, seen, standing
from tests.stack.sim.sim_rover import square_room

SCOUT = find_robot("scout", find_mission("01_drive_to_a_point"))
REAR = """
lidars:
  rear: {position: [-15 cm, 0], yaw: 180 deg, height: 10 cm, beams: 31, field_of_view: 60 deg}
"""


def scout_with(tmp_path, text):
    (tmp_path / "scout.urdf").write_text(SCOUT.with_name("scout.urdf").read_text("utf-8"), "utf-8")
    (tmp_path / "robot.yaml").write_text(SCOUT.read_text("utf-8") + text, "utf-8")
    return read_robot(tmp_path / "robot.yaml")


def test_the_scout_has_three_sonars():
    sonars = read_robot(SCOUT).sonars
    assert list(sonars) == ["front_left", "front", "front_right"]
    assert sonars["front_left"].mount.heading == pytest.approx(20 * pi / 180)


def test_every_sensor_measures_at_its_rate(tmp_path):
    robot = scout_with(tmp_path, REAR)
    body = SimulatedBody(robot, square_room(1.5), start=Pose2D(0.0, 0.0), seed=1)
    try:
        seen = []
        for _ in range(20):
            body.wait(0.05)
            seen.append(body.sense())
    finally:
        body.close()
    assert (
        sum(len(item.of(RangeReading)) for item in seen) == 33
    )  # three sonars at 0.0, 0.1 … 1.0 s
    rear = [item.of(Scan)["rear"] for item in seen if "rear" in item.measurements]
    assert len(rear) == 11
    # The middle beam looks back from 0.15 m behind the base to the wall 1.5 m behind it.
    assert np.nanmedian([scan.ranges[15] for scan in rear]) == pytest.approx(1.35, abs=0.01)


@pytest.mark.parametrize(
    ("mask", "words"),
    [
        ("[[10 deg, 350 deg]]", "from `from` anticlockwise to `to` it is 340 deg"),
        ("[[1 deg, 1 deg]]", "it is 0 deg"),
        ("[10 deg, 20 deg]", "mask[0]: expected [from, to]"),
        ("[[10 deg]]", "mask[0]: expected [from, to]"),
        ("[[10 m, 20 m]]", "10 m"),
        ("yes", "mask: expected a list of [from, to]"),
    ],
)
def test_wrong_masks_are_findings(tmp_path, mask, words):
    rear = REAR.replace("height: 10 cm", f"height: 10 cm, mask: {mask}")
    with pytest.raises(InputError, match=re.escape(words)):
        scout_with(tmp_path, rear)


@pytest.mark.parametrize(
    ("tilt", "words"),
    [
        ("roll: 90 deg", "roll: a lidar tilted by 90 deg does not scan parallel to the floor"),
        ("roll: -170 deg", "roll: a lidar tilted by 10 deg"),
        ("pitch: 15 deg", "pitch: a lidar tilted by 15 deg"),
        ("pitch: 180 deg", "pitch: a lidar tilted by 180 deg"),
        ("roll: 200 deg", "roll"),
    ],
)
def test_a_tilted_lidar_is_a_finding(tmp_path, tilt, words):
    with pytest.raises(InputError, match=re.escape(words)):
        scout_with(tmp_path, REAR.replace("height: 10 cm", f"height: 10 cm, {tilt}"))


@pytest.mark.parametrize("roll", ["180 deg", "-180 deg", "178 deg"])
def test_the_mask_of_a_lidar_upside_down_is_mirrored(tmp_path, roll):
    upside_down = f"height: 10 cm, roll: {roll}, mask: [[10 deg, 20 deg]]"
    lidar = scout_with(tmp_path, REAR.replace("height: 10 cm", upside_down)).lidars["rear"]
    assert lidar.masks(np.radians([-15.0, 15.0])).tolist() == [True, False]


def test_a_mask_may_go_across_the_end_of_the_turn(tmp_path):
    rear = REAR.replace("height: 10 cm", "height: 10 cm, mask: [[170 deg, -170 deg]]")
    lidar = scout_with(tmp_path, rear).lidars["rear"]
    angles = np.radians([-171.0, -169.0, 0.0, 169.0, 171.0, 180.0])
    assert lidar.masks(angles).tolist() == [True, False, False, False, True, True]


def test_the_name_of_the_main_lidar_is_reserved(tmp_path):
    with pytest.raises(InputError, match="the name `lidar` is reserved"):
        scout_with(tmp_path, "lidars: {lidar: {}}")


def test_a_wrong_sonar_is_reported_at_its_place(tmp_path):
    text = SCOUT.read_text("utf-8").replace(
        "height: 6 cm, field_of_view: 30", "height: 0, beams: 30"
    )
    (tmp_path / "scout.urdf").write_text(SCOUT.with_name("scout.urdf").read_text("utf-8"), "utf-8")
    (tmp_path / "robot.yaml").write_text(text, "utf-8")
    with pytest.raises(InputError, match=r"`sonars\.front_left` has no key 'beams'") as refused:
        read_robot(tmp_path / "robot.yaml")
    assert len(refused.value.findings) == 6  # height and beams, three times


def safety_of(robot):
    return SafetyStage(robot, SafetyParameters(), 0.05)


def scan(stamp, distance, mount=Pose2D(0.0, 0.0)):
    ranges = np.full(360, distance, dtype=np.float32)
    return Scan(stamp, ranges, -pi, 2 * pi / 360, 0.05, 12.0, mount)


def two_lidars():
    return replace(
        read_robot(SCOUT), sonars={}, lidars={"rear": LidarDescription(Pose2D(0.0, 0.0))}
    )


def backing(safety, robot, more, time=1.0):
    """What is left of a wish to back up once the smoother has followed it."""
    for _ in range(40):
        twist = safety.limit(
            Twist(-0.2), standing(time), seen(robot, time, lidar=scan(time, 5.0), **more)
        )
    return twist


def test_what_only_the_second_lidar_sees_stops_the_robot():
    robot = two_lidars()
    assert backing(safety_of(robot), robot, {"rear": scan(1.0, 5.0)}).linear == pytest.approx(-0.2)
    assert backing(safety_of(robot), robot, {"rear": scan(1.0, 0.26)}).linear == 0.0


def test_a_second_lidar_that_fell_silent_stops_the_robot_and_is_named():
    robot = two_lidars()
    safety = safety_of(robot)
    assert backing(safety, robot, {"rear": scan(0.5, 5.0)}) == STANDSTILL
    assert safety.reason == "stopped: the newest rear scan is 0.50 s old"


def without_sonars(folder):
    """The scout without its sonars, beside its URDF."""
    robot = folder / "deaf"
    robot.mkdir()
    (robot / "scout.urdf").write_bytes(SCOUT.with_name("scout.urdf").read_bytes())
    text = re.sub(r"sonars:.*\n(  .*\n)+", "", SCOUT.read_text("utf-8"))
    (robot / "robot.yaml").write_text(text, "utf-8")
    return str(robot / "robot.yaml")


def test_a_robot_without_a_low_sensor_drives_into_a_pallet(tmp_path):
    """What the sonars of mission 18 are for: without them there is contact."""
    source = find_mission("18_below_the_lidar").read_text("utf-8")
    path = tmp_path / "deaf.yaml"
    path.write_text(source.replace("[obstacle, range]", "[obstacle]"), "utf-8")
    assert missions.run(path, seed=0, robot=without_sonars(tmp_path)).collisions > 0


def test_the_safety_stage_stops_at_what_only_the_sonars_see(tmp_path):
    """Without the range layer the path leads over the pallet; the robot stands before it."""
    source = find_mission("18_below_the_lidar").read_text("utf-8")
    path = tmp_path / "unmapped.yaml"
    path.write_text(source.replace("[obstacle, range]", "[obstacle]"), "utf-8")
    report = missions.run(path, seed=0)
    assert (report.status, report.collisions) == ("failure", 0)
