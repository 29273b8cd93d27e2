"""A base that carries an arm: which of them moves, what the arm avoids, a whole mission."""

import shutil
import tempfile
from math import pi
from pathlib import Path

import numpy as np
import pytest

from robots.scripted import ScriptedBody, scans_of
from stack.geometry.rotations import from_angles
from stack.telemetry.records import MissionState
from stack.types import Block, JointState, Pose2D
from tests.benchmarks.fetching import run_once
from tests.missions.execution.arm_leaves import STEP

HEAD = "mission: mobile\nrobot: fetcher\nworld: parts_store\nplugins: [./arm_leaves.py]\n"
AHEAD = "{x: 7 m, y: 1.5 m, heading: 90 deg}"
FARTHEST = 0.1
"""Radians by which a joint may be away from `home` while the base drives."""


def scripted(setup):
    return ScriptedBody(setup.robot, scans_of(setup.robot, setup.world), start=setup.start)


@pytest.fixture
def live(tmp_path, live_run):
    folder = tmp_path / "m"
    folder.mkdir()
    shutil.copy(Path(__file__).with_name("arm_leaves.py"), folder)

    return lambda text, make_body=None: live_run(folder, text, head=HEAD, make_body=make_body)


class Watch:
    """Follows a run: what moved in each step, and whether both did."""

    def __init__(self, run):
        self.run, self.moved, self.both = run, [], 0
        self.home = run.engine.body.description.arm.postures["home"]

    def until_over(self, within=1500):
        for _ in range(within):
            self.run.steps()
            if self.run.runtime.state.is_over:
                break
            self._look()
        return self.run.runtime.state is MissionState.SUCCESS, self.run.runtime.reason

    def _look(self):
        perceived = self.run.runtime.perceived
        joints = perceived.newest("joints", JointState)
        drives = not perceived.motion.twist.stands
        away = np.abs(joints.positions - self.home).max() > FARTHEST
        self.both += drives and away
        now = "base" if drives else "arm" if np.abs(joints.velocities).max() > 0.02 else ""
        if now and (not self.moved or self.moved[-1] != now):
            self.moved.append(now)


@pytest.mark.parametrize("motion", ["back_up: {distance: 20 cm}", "spin: {angle: 40 deg}"])
def test_a_motion_of_the_base_waits_until_the_arm_is_at_home(live, motion):
    run = live(f"run: {{sequence: [move_arm: {{posture: look}}, {motion}]}}\n", scripted)
    watch = Watch(run)
    assert watch.until_over() == (True, ""), run.texts()
    # To `look`, back to `home` without being asked for, and only then the base.
    assert watch.moved == ["arm", "base"] and watch.both == 0
    joints = run.runtime.perceived.newest("joints", JointState)
    assert joints.positions == pytest.approx(watch.home, abs=0.01)
    assert run.texts("held") == ["stopped: the arm moves"]


@pytest.mark.parametrize(
    "motion", ["move_arm: {posture: look}", "swing_arm: {share: -0.5}"], ids=["planned", "given"]
)
def test_a_motion_of_the_arm_interrupts_one_of_the_base_and_begins_when_it_stands(live, motion):
    run = live(
        "start: [3, 1, 180 deg]\nrun:\n  parallel:\n"
        "    - drive_on_heading: {distance: 60 cm, speed: 0.2 m/s}\n"
        f"    - sequence: [wait: 1 s, {motion}]\n", scripted
    )  # fmt: skip
    start = run.engine.body.pose
    watch = Watch(run)
    assert watch.until_over() == (True, ""), run.texts()
    assert watch.moved == ["base", "arm", "base"] and watch.both == 0
    assert run.engine.body.pose.distance_to(start) == pytest.approx(0.6, abs=0.03)


def test_a_base_does_not_drive_with_an_arm_that_cannot_come_home(live):
    run = live(
        "run: {sequence: [move_arm: {posture: look}, back_up: {distance: 20 cm}]}\n", scripted
    )
    arm = run.runtime.parts.robot.arm
    while not _at(arm, "look"):
        run.steps()
    # Something is where the hand would have to be: at `home` the tool is at (0.18, 0, 0.41).
    arm.see([_block(from_angles((0.24, 0.0, 0.42), (0.0, 0.0, 0.0)))])
    done, reason = Watch(run).until_over()
    assert not done and "the arm cannot move to `home`: at the goal: panda_" in reason
    assert run.engine.body.pose.distance_to(Pose2D(1.38, 1.0)) == pytest.approx(0.0, abs=1e-9)


def test_the_base_waits_for_a_behaviour_that_uses_the_arm_twice(live):
    drive = "back_up: {distance: 20 cm}"
    run = live(f"run: {{parallel: [swing_twice: {{}}, {drive}]}}\n", scripted)
    swung = run.engine.body.description.arm.postures["home"] + 2.0 * STEP
    watch, farthest = Watch(run), np.inf
    while not run.runtime.state.is_over:
        watch.until_over(within=1)
        joints = run.runtime.perceived.newest("joints", JointState).positions
        farthest = min(farthest, np.abs(joints - swung).max())
    assert watch.until_over() == (True, ""), run.texts()
    # Both swings one after the other, the second from where the first one ended; then home.
    assert farthest < 0.01 and watch.moved == ["arm", "base"] and watch.both == 0


def test_the_arm_does_not_go_home_while_the_fingers_move(live):
    run = live("run: {sequence: [move_arm: {posture: look}, parallel: [move_fingers: 1 cm, "
               "back_up: {distance: 20 cm}]]}\n", scripted)  # fmt: skip
    robot = run.runtime.parts.robot
    while not robot.gripper.is_busy:
        run.steps()
    while robot.gripper.is_busy:
        assert _at(robot.arm, "look") and not robot.arm.is_busy
        run.steps()
    assert Watch(run).until_over() == (True, ""), run.texts()


@pytest.mark.parametrize("interruption", ["estop", "newer"])
def test_an_arm_whose_way_home_was_cancelled_begins_it_again(live, interruption):
    run = live(
        "run: {sequence: [move_arm: {posture: look}, back_up: {distance: 20 cm}]}\n", scripted
    )
    arm = run.runtime.parts.robot.arm
    while not _at(arm, "look"):
        run.steps()
    while _at(arm, "look"):
        run.steps()
    if interruption == "newer":
        arm.move_to_posture("look")
    else:
        assert run.order("estop").done and run.order("release").done
        assert run.order("resume").done
    assert Watch(run).until_over() == (True, ""), run.texts()


def _at(arm, posture):
    joints = arm.joints
    return joints is not None and np.abs(joints.positions - arm.postures[posture]).max() < 0.005


def _block(pose):
    return Block("red", pose, np.full(3, 0.1), np.zeros((4, 4)), 0.0)


def test_boxes_and_blocks_stay_where_they_are_when_the_base_turns(live):
    run = live("run: {sequence: [wait: 1 s, spin: {angle: 90 deg}, wait: 1 s]}\n", scripted)
    run.steps(5)
    arm, begin = run.runtime.parts.robot.arm, run.engine.body.pose
    arm.see([_block(from_angles((0.5, 0.1, 0.2), (0.0, 0.0, 0.0)))])
    for _ in range(2):
        tray, _ = arm.box("the tray")
        # The tray is at (0.5, 1.0) on the map, the arm 12 cm before the middle of the base.
        pose = run.runtime.perceived.estimate.pose
        expected = pose.inverse().transform(np.array([[0.5, 1.0]]))[0] - (0.12, 0.0)
        assert tray[:2, 3] == pytest.approx(expected, abs=1e-9)
        # The block was 0.62 m before the base and 0.1 m to its left; odometry is exact here.
        turned = run.engine.body.pose.relative_to(begin)
        expected = turned.inverse().transform(np.array([[0.62, 0.1]]))[0] - (0.12, 0.0)
        [block] = arm.blocks.values()
        assert block.pose[:2, 3] == pytest.approx(expected, abs=1e-9)
        assert Watch(run).until_over() == (True, "")
    assert turned.heading == pytest.approx(pi / 2.0, abs=0.05)


def test_a_correction_of_the_pose_moves_boxes_but_no_block_that_was_seen(live):
    run = live("run: {wait: 9 s}\n", scripted)
    run.steps(5)
    robot = run.runtime.parts.robot
    robot.arm.see([_block(from_angles((0.5, 0.1, 0.2), (0.0, 0.0, 0.0)))])
    before, tray = robot.arm.blocks["red block"].pose, robot.arm.box("the tray")[0]
    pose = run.runtime.perceived.estimate.pose
    robot.localisation.set_pose(
        Pose2D(pose.x + 0.1, pose.y, pose.heading), position_deviation=0.01,
        heading_deviation=0.01, source="test",
    )  # fmt: skip
    run.steps(1)
    moved = run.runtime.perceived.estimate.pose.distance_to(pose)
    assert moved == pytest.approx(0.1, abs=0.01)
    # The block is where the camera has shown it; the tray is on the map, 10 cm farther back.
    assert robot.arm.blocks["red block"].pose == pytest.approx(before, abs=1e-9)
    shift = np.linalg.norm((robot.arm.box("the tray")[0] - tray)[:2, 3])
    assert shift == pytest.approx(moved, abs=1e-9)


@pytest.mark.slow
def test_a_block_is_fetched_from_another_room_without_a_contact():
    with tempfile.TemporaryDirectory() as folder:
        row = run_once(101, Path(folder))
    assert row.done, row
