"""Motions of an arm that cannot begin: trajectories that are refused, waits that end."""

from dataclasses import replace

import numpy as np
import pytest

from stack.errors import ParameterError
from stack.lifecycle import Timers
from stack.navigation.capabilities.arm import StackArm
from stack.navigation.capabilities.arm_motion import STANDS_WITHIN
from stack.navigation.capabilities.surroundings import Surroundings
from stack.navigation.plans.arm_plans import ArmPlans
from stack.perception.camera_lease import CameraLease
from stack.types import (
    Block,
    CurrentStep,
    GripperState,
    JointState,
    JointTrajectory,
    Odometry,
    Perceived,
    Pose2D,
    PoseEstimate,
    Twist,
)
from tests.stack.sim.arm_world import HOME, PANDA, motion

END = HOME + np.array([0.6, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
STILL, DRIVES = Twist(0.0, 0.0), Twist(0.3, 0.0)


def record(time, twist=STILL, joints=HOME, speed=0.0):
    """What a step has perceived: the joints at a place and a speed; None: not measured."""
    odometry = Odometry(time, Pose2D(0.0, 0.0), twist)
    measured = {}
    if joints is not None:
        rates = np.full(7, speed)
        measured["joints"] = JointState(time, joints, rates, np.zeros(7))
    estimate = PoseEstimate(Pose2D(0.0, 0.0), np.zeros((3, 3)), 1.0)
    return Perceived(time, estimate, odometry, measurements=measured)


class Rig:
    """An arm whose records the test writes."""

    def __init__(self):
        self.told, self.now = [], CurrentStep(record(0.0))
        self.plans = ArmPlans(PANDA, 1, print, is_real_time=False)
        around, lease = Surroundings([]), CameraLease()
        self.arm = StackArm(PANDA, self.now, Timers(), self.plans, around, lease, self._emit)

    def _emit(self, kind, text, **fields):
        self.told.append((kind, text, fields))

    def see(self, perceived):
        self.now.see(perceived)
        self.arm.step(perceived, held=False)


@pytest.fixture
def rig():
    made = Rig()
    yield made
    made.plans.close()


@pytest.mark.parametrize(
    ("seen", "why"),
    [
        ({"joints": None}, "the joints are not measured"),
        ({"speed": 0.05}, "the arm does not come to rest"),
        ({"twist": DRIVES}, "the base does not come to rest"),
    ],
)
def test_a_planned_motion_that_cannot_begin_fails(rig, seen, why):
    task = rig.arm.move_joints(END)
    rig.see(record(STANDS_WITHIN, **seen))
    assert task.running and rig.arm.is_busy
    rig.see(record(STANDS_WITHIN + 0.1, **seen))
    assert (task.failure.code, task.failure.sentence) == ("NO_PROGRESS", f"{why} within 10 s")
    assert not rig.arm.is_busy


def test_a_given_motion_that_cannot_begin_fails(rig):
    rig.now.see(record(0.0, DRIVES))
    task = rig.arm.follow(motion(HOME, END))
    rig.see(record(STANDS_WITHIN, DRIVES))
    assert task.running
    rig.see(record(STANDS_WITHIN + 0.1, DRIVES))
    assert task.failure.sentence == "the base does not come to rest within 10 s"
    assert not rig.arm.is_busy


@pytest.mark.parametrize("part", ["times", "positions", "velocities"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_trajectory_with_a_number_that_is_not_finite_is_refused(rig, part, value):
    given = motion(HOME, END)
    numbers = getattr(given, part).copy()
    numbers[20] = value
    with pytest.raises(ParameterError, match="must be finite"):
        rig.arm.follow(replace(given, **{part: numbers}))


def test_a_trajectory_beyond_a_speed_limit_is_refused(rig):
    """A quintic is at most 15/8 of its mean speed: 0.6 rad * 15/8 / 0.5 s = 2.25 rad/s."""
    limit = PANDA.arm.limits.velocity[0]
    assert limit == pytest.approx(2.175)
    with pytest.raises(ParameterError, match=r"panda_joint1 would move at 2\.250 .* 2\.175"):
        rig.arm.follow(motion(HOME, END, seconds=0.5))
    assert rig.arm.follow(motion(HOME, END, seconds=0.6)).running
    given = motion(HOME, END, seconds=0.5)
    with pytest.raises(ParameterError, match="faster than its limit"):  # velocities that lie
        rig.arm.follow(replace(given, velocities=np.zeros_like(given.velocities)))


def test_a_trajectory_must_begin_where_the_joints_are(rig):
    with pytest.raises(ParameterError, match=r"it begins 0\.600 from where panda_joint1 is"):
        rig.arm.follow(motion(END, HOME))
    rig.now.see(record(0.0, joints=None))
    with pytest.raises(ParameterError, match="the joints are not measured yet"):
        rig.arm.follow(motion(HOME, END))


def test_a_motion_that_stops_on_its_way_fails_after_its_time(rig):
    task = rig.arm.follow(motion(HOME, END, seconds=2.0))
    for time in np.arange(0.05, 3.95, 0.05):
        rig.see(record(time))
    assert task.running
    rig.see(record(4.1))
    assert (task.failure.code, task.failure.sentence) == (
        "NO_PROGRESS", "panda_joint1 is still 0.600 from its goal",
    )  # fmt: skip


def test_a_trajectory_needs_two_rows(rig):
    with pytest.raises(ParameterError, match="at least 2 rows of 7 positions"):
        rig.arm.follow(JointTrajectory(np.zeros(1), HOME[np.newaxis], np.zeros((1, 7))))


@pytest.mark.parametrize(("width", "lost"), [(0.05, False), (0.03, False), (0.001, True)])
def test_fingers_that_close_in_a_motion_have_lost_the_block(rig, width, lost):
    """The block is 5 cm wide: fingers half as far apart cannot hold it."""
    block = Block("red", np.eye(4), np.full(3, 0.05), np.zeros((4, 4)), 0.0)
    rig.now.see(record(0.0))
    rig.arm.hold(block, 0.05)
    task = rig.arm.follow(motion(HOME, END))
    rig.see(record(0.05))
    seen = record(0.10)
    fingers = GripperState(0.10, width, 40.0, moving=False)
    measured = {**seen.measurements, "gripper": fingers}
    rig.now.see(replace(seen, measurements=measured))
    _, stops = rig.arm.step(rig.now.perceived, held=False)
    assert stops is lost and (rig.arm.held is None) is lost
    assert task.running is not lost
    if lost:
        assert (task.failure.code, task.failure.sentence) == ("SLIPPED", "the red block was lost")
        assert not rig.arm.blocks, "nobody knows where it is"
        fields = {"level": "warning", "did": "lost", "colour": "red"}
        assert rig.told == [("arm", "the red block was lost", fields)]
