"""Blocks in pictures that were taken before the base moved on, and misses of the camera."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.frames.buffer import TransformBuffer
from stack.navigation.capabilities.perception import StackPerception
from stack.navigation.capabilities.surroundings import Surroundings
from stack.perception.blocks import BlockDetector
from stack.perception.calibration_watch import CalibrationWatch
from stack.perception.camera_lease import CameraLease
from stack.types import CurrentStep, Odometry, Perceived, Pose2D, PoseEstimate, Twist
from tests.stack.perception.block_scene import BASE_FROM_LINK, COLOURS, Bench
from tests.stack.perception.test_closer_look import CUBE, block, picture
from tests.stack.sim.arm_world import PANDA
from tests.stack.sim.arm_world import block as world_block

START, TURNED = Pose2D(0.0, 0.0), Pose2D(0.1, 0.0, pi / 6)
ESTIMATE = PoseEstimate(START, np.zeros((3, 3)), 1.0)


class Rig:
    """The perception of an arm whose base is where the test says."""

    def __init__(self, base_from_link):
        self.frames, self.now = TransformBuffer(), CurrentStep(Perceived(0.0, ESTIMATE))
        self.events = []
        self.perception = StackPerception(
            robot=PANDA, now=self.now, frames=self.frames, estimator=None, camera=CameraLease(),
            depth_camera=CameraLease(), objects=None, places=None, detector=None, lines=None,
            coloured=None, block_detector=BlockDetector(base_from_link),
            calibration=CalibrationWatch(), emit=lambda kind, text, **_: self.events.append(kind),
        )  # fmt: skip

    def see(self, time, pose, **pictures):
        odometry = Odometry(time, pose, Twist(0.0, 0.0))
        self.frames.add(odometry)
        self.now.see(Perceived(time, ESTIMATE, odometry, measurements=pictures))


def test_a_block_is_where_the_base_was_when_the_picture_was_taken():
    rig, bench = Rig(BASE_FROM_LINK), Bench(replace(world_block(), colour=COLOURS["red"]))
    try:
        colour, depth = bench.pictures([(0.5, 0.1, 0.625, 0.0)])
    finally:
        bench.close()
    rig.see(0.0, START)
    assert rig.perception.blocks() is None  # this switches the cameras on
    rig.see(0.2, START, camera=colour, overhead=depth)
    [there] = rig.perception.blocks()
    rig.see(0.4, TURNED, camera=colour, overhead=depth)
    [now] = rig.perception.blocks()
    expected = TURNED.inverse().transform(there.pose[None, :2, 3])[0]  # the arm is at the middle
    assert there.pose[:2, 3] == pytest.approx((0.5, 0.1), abs=5e-3)
    assert now.pose[:2, 3] == pytest.approx(expected, abs=1e-9)
    assert now.pose[2, 3] == pytest.approx(there.pose[2, 3]) and now.camera == "overhead"
    assert not rig.perception.is_gone(now)
    assert rig.perception.is_gone(replace(now, pose=now.pose @ shifted(0.15)))


def shifted(distance):
    moved = np.eye(4)
    moved[0, 3] = distance
    return moved


def test_a_closer_look_after_the_base_moved_shows_the_block_where_it_is_now():
    rig, there = Rig(np.eye(4)), block(0.5, 0.1, 0.0, CUBE)
    rig.see(0.5, START)
    assert rig.perception.look_closer(there, 0.5) is None  # this switches the camera on
    rig.see(1.0, START, hand=picture((0.5, 0.1, 0.0, CUBE)))
    rig.see(1.2, TURNED, hand=picture((0.5, 0.1, 0.0, CUBE)))
    x, y = TURNED.inverse().transform(np.array([[0.5, 0.1]]))[0]
    seen = rig.perception.look_closer(block(x, y, -pi / 6, CUBE), 0.5)
    assert seen.pose[:2, 3] == pytest.approx((x, y), abs=1.5e-3) and seen.camera == "hand"


@pytest.mark.parametrize(("camera", "events"), [("overhead", ["calibration"]), ("", [])])
def test_only_places_that_the_camera_has_shown_count_as_its_misses(camera, events):
    """The hand lets a block fall from 4 mm over its place: more than the LEAST_OFFSET."""
    rig = Rig(np.eye(4))
    for time in (1.0, 2.0, 3.0, 4.0):
        rig.see(time, START, hand=picture((0.5, 0.1, 0.0, CUBE), stamp=time))
        known = replace(block(0.5, 0.1, 0.0, CUBE, z=0.029), camera=camera)
        rig.perception.look_closer(known, 0.0)
    assert rig.events == events


def test_a_block_that_the_hand_has_placed_was_not_shown_there_by_a_camera():
    around, tool = Surroundings([]), np.eye(4)
    around.hold(replace(block(0.5, 0.1, 0.0, CUBE), camera="overhead"), tool, 0.05)
    assert around.held_at(tool).camera == "overhead"
    around.release(tool)
    assert [it.camera for it in around.blocks.values()] == [""]


def test_a_lost_block_is_a_change():
    around = Surroundings([])
    around.hold(block(0.5, 0.1, 0.0, CUBE), np.eye(4), 0.05)
    version = around.version
    around.lose()
    assert around.version > version
