"""dock and undock on a kinematic robot with a lidar, in a room with a block and its slot."""

from dataclasses import dataclass, field
from math import pi, radians

import numpy as np
import pytest
from py_trees.common import Status

from behaviours._sensing.dock_fit import DockFitter
from behaviours.docking.dock import Dock, steered
from behaviours.docking.undock import Undock
from behaviours.testing import ScriptedTask, tick
from stack.types import Battery, DockShape, Pose2D, wrap_angle
from tests.behaviours.kinematic_robot import PERIOD, KinematicRobot, cast_rays, segments_of

SHAPE = DockShape()
ROOM = segments_of([(-0.2, -2), (4, -2), (4, 2), (-0.2, 2), (-0.2, -2)])
FACE = Pose2D(0.0, 0.0, 0.0)


def block(pose=FACE):
    corners = pose.transform(SHAPE.outline)
    return segments_of([tuple(corner) for corner in corners])


@dataclass
class DockingRobot(KinematicRobot):
    """Is put where it is told to navigate to, a little off, and charges at the true dock."""

    true_dock: Pose2D = FACE
    charges: bool = True
    off: Pose2D = Pose2D(0.05, 0.08, 0.1)
    backed: list[float] = field(default_factory=list)

    def navigate_to(self, goal, *, tolerance=None, partial=False):
        task = super().navigate_to(goal, tolerance=tolerance, partial=partial)
        self.pose = goal.compose(self.off)
        task.succeed()
        return task

    def back_up(self, distance, *, speed=None, while_lost=False):
        task: ScriptedTask = super().back_up(distance, speed=speed, while_lost=while_lost)
        self.backed.append(distance)
        self.pose = self._moved(self.pose, -distance, 0.0)
        self.odometry = self._moved(self.odometry, -distance, 0.0)
        task.succeed()
        return task

    def _step(self):
        super()._step()
        at = self.pose.relative_to(self.true_dock)
        touches = abs(at.x - self.footprint.front) < 0.04 and abs(at.y) < 0.02
        self.battery = Battery(0.5, charging=self.charges and touches)


def robot_at(dock=FACE, start=Pose2D(2.0, 0.5, pi), **more):
    walls = np.concatenate([ROOM, block(dock)])
    return DockingRobot(segments=walls, pose=start, true_dock=dock, **more)


def test_it_stands_at_the_dock_to_a_few_millimetres():
    robot = robot_at()
    behaviour = Dock(dock=FACE)
    assert tick(behaviour, robot, 60.0) is Status.SUCCESS
    at = robot.pose.relative_to(FACE)
    assert at.x - robot.footprint.front == pytest.approx(0.02, abs=0.008)
    assert at.y == pytest.approx(0.0, abs=0.008)
    assert abs(wrap_angle(at.heading - pi)) < radians(1.5)
    assert behaviour.attempts == 1 and behaviour.position_error < 0.01


def test_it_finds_a_dock_that_is_not_quite_where_the_map_says():
    dock = Pose2D(0.1, -0.15, radians(8.0))
    robot = robot_at(dock)
    assert tick(Dock(dock=FACE), robot, 60.0) is Status.SUCCESS
    at = robot.pose.relative_to(dock)
    assert (at.x - robot.footprint.front, at.y) == pytest.approx((0.02, 0.0), abs=0.01)


def test_only_the_approach_may_touch_and_only_the_dock():
    robot = robot_at()
    behaviour = Dock(dock=FACE)
    while not robot.calls_of("drive_for") or robot.twist.linear == 0.0:
        tick(behaviour, robot, 0.1)
    in_odom = robot.odometry.compose(FACE.relative_to(robot.pose))
    beside = np.array([[0.2, 0.0], [-0.1, 0.35], [-0.1, -0.35], [-0.4, 0.0]])
    assert robot.contact.contains(in_odom.transform(SHAPE.outline)).all()
    assert not robot.contact.contains(in_odom.transform(beside)).any()
    tick(behaviour, robot, 60.0)
    assert robot.contact is None and robot.twist.linear == 0.0


def test_without_current_it_backs_off_and_tries_again():
    robot = robot_at(charges=False)
    behaviour = Dock(dock=FACE, tries=2)
    assert tick(behaviour, robot, 120.0) is Status.FAILURE
    assert behaviour.failure.code == "NOT_CHARGING" and "2 attempts" in behaviour.failure.sentence
    # From 2 cm in front of the dock back to 60 cm.
    assert robot.backed == [pytest.approx(0.58, abs=0.02)]


def test_a_wall_without_a_slot_is_no_dock():
    robot = DockingRobot(segments=ROOM, pose=Pose2D(2.0, 0.0, pi))
    behaviour = Dock(dock=FACE, tries=1)
    assert tick(behaviour, robot, 60.0) is Status.FAILURE
    assert behaviour.failure.code == "DOCK_NOT_FOUND"
    assert robot.pose.x > 0.7


def test_a_place_that_cannot_be_reached_is_said():
    class Blocked(DockingRobot):
        def navigate_to(self, goal, *, tolerance=None, partial=False):
            task = KinematicRobot.navigate_to(self, goal, tolerance=tolerance, partial=partial)
            task.fail("NO_VALID_PATH", "no path")
            return task

    behaviour, robot = Dock(dock=FACE), Blocked(segments=ROOM)
    assert tick(behaviour, robot) is Status.RUNNING or behaviour.failure
    tick(behaviour, robot, 1.0)
    assert behaviour.failure.code == "NO_VALID_PATH"
    assert behaviour.failure.sentence == "in front of the dock: no path"


def test_undock_goes_back_and_turns():
    robot = robot_at(start=Pose2D(0.3, 0.0, pi))
    behaviour = Undock(distance=0.5, turn=True)
    assert tick(behaviour, robot) is Status.RUNNING
    tick(behaviour, robot, 0.2)
    assert robot.backed == [0.5] and robot.calls_of("spin")[0]["angle"] == pytest.approx(pi)
    robot.task.succeed()
    assert tick(behaviour, robot, 0.2) is Status.SUCCESS


FITTER = DockFitter(SHAPE)


def fitted(random):
    """A random dock within 1.2 m, and what is found of it in a scan with 1 cm of noise."""
    distance, bearing, turn = random.uniform([0.35, -0.4, -0.25], [1.2, 0.4, 0.25])
    dock = Pose2D(distance * np.cos(bearing), distance * np.sin(bearing), pi + bearing + turn)
    angles = np.radians(np.arange(-180.0, 180.0))
    ranges = cast_rays(block(dock), Pose2D(0.0, 0.0), angles) + random.normal(0.0, 0.01, 360)
    seen, angles = ranges[np.isfinite(ranges)], angles[np.isfinite(ranges)]
    points = np.column_stack([seen * np.cos(angles), seen * np.sin(angles)])
    return dock, FITTER.fit(points, dock.compose(Pose2D(*random.uniform(-0.2, 0.2, 3))))


def test_the_fit_is_exact_to_a_few_millimetres_of_noise():
    # 1 cm of noise on some 40 points: 1 cm / sqrt(40) = 1.6 mm, and 0.02 rad for the arm of 20 cm.
    # Of 12 000 such scans, 73 were refused, all from beyond 0.7 m, where 1 cm of noise and 20
    # points may hide the slot; the error is below 2.3 cm and 3.7 degrees in 99.9 %.
    random = np.random.default_rng(4)
    pairs = [fitted(random) for _ in range(300)]
    found = [(dock, fit) for dock, fit in pairs if fit is not None]
    assert len(found) >= 294
    away = [fit.distance_to(dock) for dock, fit in found]
    turned = [abs(wrap_angle(fit.heading - dock.heading)) for dock, fit in found]
    assert np.median(away) < 0.005 and np.percentile(away, 99) < 0.02
    assert np.median(turned) < radians(1.2) and np.percentile(turned, 99) < radians(4.0)


@pytest.mark.parametrize("heading", [-0.6, -0.2, 0.0, 0.3, 0.7])
@pytest.mark.parametrize("aside", [-0.15, 0.0, 0.1])
def test_the_control_law_leads_to_the_pose(aside, heading):
    pose, target = Pose2D(1.0, aside, pi + heading), Pose2D(0.0, 0.0, pi)
    for _ in range(1200):
        if pose.x < 0.15:
            break
        twist = steered(pose, target, 0.1)
        pose = KinematicRobot._moved(pose, twist.linear * PERIOD, twist.angular * PERIOD)
    assert pose.x < 0.15 and abs(pose.y) < 0.005
    assert abs(wrap_angle(pose.heading - pi)) < radians(3.0)
