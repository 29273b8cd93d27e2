"""`treepilot calibrate hand-eye`: from a recording with pictures of a marker to the robot file."""

from dataclasses import replace
from math import radians

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from robots.load import read_robot
from stack.errors import InputError
from stack.frames.links import RobotLinks
from stack.frames.tree import inverse
from stack.geometry.rotations import from_angles
from stack.telemetry.sensor_log import SensorLog
from stack.types import Image, JointState, Observation

SIDE = 0.06
ROBOT = """robot: seeing_arm
format: 1
urdf: package://pybullet_data/franka_panda/panda.urdf
mount: {height: 60 cm}
arm:
  postures:
    home: [0, -0.785, 0, -2.356, 0, 1.571, 0.785]
camera:                     # as measured with a ruler
LINK  position: POSITION
  yaw: YAW
  pitch: PITCH
  width: 640
  height: 480
  field_of_view: 60 deg
"""
HOME = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])


def picture(camera, optical_from_marker):
    """A grey picture with marker 7 on a white board, drawn four times as fine and averaged."""
    board = np.full((500, 500), 255, np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    board[50:450, 50:450] = cv2.aruco.generateImageMarker(dictionary, 7, 400)
    half = 1.25 * SIDE / 2
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    seen = square @ optical_from_marker[:3, :3].T + optical_from_marker[:3, 3]
    source = np.array([[0, 0], [500, 0], [500, 500], [0, 500]], np.float32) - np.float32(0.5)
    corners = (4.0 * camera.project(seen)).astype(np.float32) - np.float32(0.5)
    warp = cv2.getPerspectiveTransform(source, corners)
    size = 4 * camera.width, 4 * camera.height
    drawn = cv2.warpPerspective(board, warp, size, borderValue=130)
    small = cv2.resize(drawn, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return np.repeat(small[..., None], 3, axis=2)


def recorded(path, robot, true, marker, count=18):
    """A recording in which the arm stands at poses around home while the camera takes pictures."""
    links, random, time = RobotLinks(robot.links, "base"), np.random.default_rng(5), 0.0
    in_hand = bool(robot.camera.link)
    log = SensorLog(path, {})
    for _ in range(count):
        positions = HOME + random.uniform(-0.3, 0.3, 7)
        at = dict(zip(robot.arm.joints, positions.tolist(), strict=True))
        if in_hand:
            seen = inverse(links.pose("panda_hand", at) @ true.base_from_optical()) @ marker
        else:
            seen = inverse(true.base_from_optical()) @ links.pose(robot.arm.tool_link, at) @ marker
        for step in range(3):
            time += 0.2
            measured = {"joints": JointState(time, positions, np.zeros(7), np.zeros(7))}
            if step == 1:
                measured["camera"] = Image(time, picture(true, seen), robot.camera.model)
            log.write(Observation(time, measured))
        time += 1.0
    log.close()


def calibrated(folder, file, *words):
    words = [*map(str, words)] or ["--marker", "7", "--size", "60 mm"]
    call = ["calibrate", "hand-eye", str(file), "--from", str(folder / "sensors.mcap"), *words]
    return CliRunner().invoke(app, call)


def check(result, file, true, position, turn):
    """The mount in the robot file is the true one, and the rest of the file stays."""
    assert result.exit_code == 0, result.output
    assert "residual of a view (RMS): " in result.output
    off = inverse(true.base_from_optical()) @ read_robot(file).camera.model.base_from_optical()
    assert np.linalg.norm(off[:3, 3]) < position
    assert np.linalg.norm(cv2.Rodrigues(off[:3, :3])[0]) < radians(turn)
    assert "# as measured with a ruler" in file.read_text()


def robot_file(folder, link, position, yaw, pitch):
    text = ROBOT.replace("LINK", link).replace("POSITION", position)
    file = folder / "robot.yaml"
    file.write_text(text.replace("YAW", yaw).replace("PITCH", pitch))
    return file


@pytest.fixture
def in_hand(tmp_path):
    return robot_file(tmp_path, "  link: panda_hand\n", "[6 cm, 0, 2 cm]", "0", "-90 deg")


def test_the_mount_of_a_camera_in_the_hand_is_written(in_hand, tmp_path):
    robot = read_robot(in_hand)
    true = replace(
        robot.camera.model, position=(0.068, 0.004, 0.025), pitch=radians(-88.0), yaw=radians(1.0)
    )
    # The board lies before the arm, 30 cm below the hand of its home posture.
    marker = from_angles((0.35, 0.0, 0.75), (0.0, 0.0, 0.3))
    recorded(tmp_path / "sensors.mcap", robot, true, marker)
    # A pixel is 0.7 mm wide at the marker.
    check(calibrated(tmp_path, in_hand), in_hand, true, 0.002, 0.3)


def test_the_mount_of_a_camera_on_a_mast_is_written(tmp_path):
    file = robot_file(tmp_path, "", "[90 cm, 0, 1.4 m]", "180 deg", "50 deg")
    robot = read_robot(file)
    true = replace(
        robot.camera.model, position=(0.92, 0.015, 1.42), pitch=radians(48.5), yaw=radians(178.0)
    )
    # The hand holds the board so that it looks up to the camera.
    marker = from_angles((0.0, 0.0, 0.03), (np.pi, -0.6, 0.2))
    recorded(tmp_path / "sensors.mcap", robot, true, marker)
    check(calibrated(tmp_path, file), file, true, 0.004, 0.4)


def test_too_few_views_and_wrong_words_are_refused(in_hand, tmp_path):
    robot = read_robot(in_hand)
    marker = from_angles((0.35, 0.0, 0.75), (0.0, 0.0, 0.3))
    recorded(tmp_path / "sensors.mcap", robot, robot.camera.model, marker, count=3)
    for words, told in (
        ((), "views show the marker, at least 5 are needed"),
        (("--marker", 8, "--size", "60 mm"), "0 views show the marker"),
        (("--marker", 7, "--size", "4 kg"), "--size 4 kg: "),
        (("--marker", 7, "--size", "0 m"), "--size 0 m: expected more than 0 m, such as 40 mm"),
    ):
        error = calibrated(tmp_path, in_hand, *words).exception
        assert isinstance(error, InputError) and told in str(error)
    assert in_hand.read_text().count("6 cm") == 1
