"""find_object and approach_object on a scripted robot that sees objects in a cone ahead."""

from dataclasses import dataclass, field, replace
from math import atan2, hypot, pi

import numpy as np
import pytest
from py_trees.common import Status

from behaviours._sensing.object_watch import ObjectWatch, WantedObject
from behaviours.perception.approach_object import ApproachObject
from behaviours.perception.find_object import FindObject
from behaviours.testing import ScriptedRobot, tick
from behaviours.timer import Timer
from stack.types import CameraModel, Detection, FailureCode, Frontier, Image, Pose2D
from tests.behaviours.kinematic_robot import PERIOD, KinematicRobot

MODEL = CameraModel(320, 240, 228.0, (0.12, 0.0, 0.35))
PIXELS = np.zeros((240, 320, 3), np.uint8)


@dataclass
class SeeingRobot(KinematicRobot):
    """Sees objects within 3 m and 35 degrees ahead, five times a second; turns as it is told.

    Attributes:
        things: (colour, x, y).
        goals: of the drives; it is put there at once, unless `unreachable` says no.
        views: returned by `frontiers()`, one at each call.
    """

    things: list[tuple[str, float, float]] = field(default_factory=list)
    goals: list[Pose2D] = field(default_factory=list)
    views: list[Frontier] = field(default_factory=list)
    unreachable: int = 0
    has_camera: bool = True
    asked: list[list[Pose2D]] = field(default_factory=list)
    left: float = 0.0

    def _step(self):
        super()._step()
        if self.left > 0.0:
            turn = min(self.left, 0.8 * PERIOD)
            self.left -= turn
            self.pose = self._moved(self.pose, 0.0, turn)
            self.odometry = self._moved(self.odometry, 0.0, turn)
            if self.left <= 0.0:
                self.turning.succeed()
        if self.has_camera and self.steps % 4 == 0:
            self.picture = Image(self.time, PIXELS, MODEL)
            self.objects = tuple(self._visible())

    def _visible(self):
        for colour, x, y in self.things:
            at = Pose2D(x, y).relative_to(self.pose)
            if hypot(at.x, at.y) < 3.0 and abs(atan2(at.y, at.x)) < 0.6:
                yield Detection(colour, self.time, (x, y), 0.03, 0.3, 0.3, (0, 0, 9, 9))

    def spin(self, angle, *, speed=None, while_lost=False):
        self.turning = super().spin(angle, speed=speed, while_lost=while_lost)
        self.left = angle
        return self.turning

    def navigate_to(self, goal, *, tolerance=None, partial=False):
        task = super().navigate_to(goal, tolerance=tolerance, partial=partial)
        self.goals.append(goal)
        if self.unreachable:
            self.unreachable -= 1
            task.fail(FailureCode.NO_VALID_PATH)
        else:
            self.pose = goal
            task.succeed()
        return task

    def frontiers(self, *, avoided=(), seen_from=None, **limits):
        self.asked.append(list(seen_from))
        known = [view for view in self.views if view.pose not in (*seen_from, *avoided)]
        return known


def view(x, y, gain=5.0, distance=2.0):
    return Frontier(Pose2D(x, y), (x + 1.0, y), 1.0, gain, distance)


def test_it_turns_until_the_object_is_in_view():
    robot = SeeingRobot(things=[("red", -2.0, 0.0), ("blue", 1.0, 0.0)])
    behaviour = FindObject(colour="red")
    assert tick(behaviour, robot, 20.0) is Status.SUCCESS
    assert (behaviour.object.x, behaviour.object.y) == pytest.approx((-2.0, 0.0))
    assert abs(behaviour.object.heading) == pytest.approx(pi)
    assert behaviour.distance == pytest.approx(2.0)
    assert behaviour.places == 0 and not robot.goals
    # Visible from 180 - 34 degrees on, two pictures later; 0.8 rad/s.
    assert robot.time == pytest.approx((pi - 0.6) / 0.8 + 0.4, abs=0.3)


def test_it_goes_to_the_view_that_shows_most_for_its_way():
    near, far = view(2.0, 0.0, gain=1.0), view(0.0, 6.0, gain=30.0, distance=4.0)
    robot = SeeingRobot(things=[("red", 0.0, 8.0)], views=[near, far])
    behaviour = FindObject(colour="red")
    assert tick(behaviour, robot, 60.0) is Status.SUCCESS
    assert robot.goals == [far.pose]
    assert robot.asked == [[Pose2D(0.0, 0.0, pytest.approx(0.4))]]
    assert behaviour.places == 1


def test_it_fails_after_all_views():
    robot = SeeingRobot(views=[view(1.0, 0.0), view(2.0, 0.0)])
    behaviour = FindObject(colour="green")
    assert tick(behaviour, robot, 120.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.OBJECT_NOT_FOUND
    assert "no green object within 4 m of 3 places" in behaviour.failure.sentence
    assert len(robot.goals) == 2


def test_a_view_that_cannot_be_reached_is_left_out():
    robot = SeeingRobot(things=[("red", 2.0, 5.0)], views=[view(1.0, 0.0), view(2.0, 3.0)])
    robot.unreachable = 1
    behaviour = FindObject(colour="red")
    assert tick(behaviour, robot, 60.0) is Status.SUCCESS
    assert robot.goals == [Pose2D(1.0, 0.0), Pose2D(2.0, 3.0)]
    assert len(robot.asked) == 2 and behaviour.places == 1


def test_a_lost_robot_does_not_search_on():
    robot = SeeingRobot(views=[view(1.0, 0.0)], health=0.1)
    behaviour = FindObject(colour="red")
    assert tick(behaviour, robot, 10.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.LOST


@pytest.mark.parametrize("kind", [FindObject, ApproachObject])
def test_a_silent_camera_is_a_failure(kind):
    robot = SeeingRobot(has_camera=False, views=[view(1.0, 0.0)])
    more = {"object": Pose2D(2.0, 0.0)} if kind is ApproachObject else {}
    behaviour = kind(colour="red", **more)
    assert tick(behaviour, robot, 30.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.NO_IMAGE


def test_one_picture_is_no_confirmation():
    robot = ScriptedRobot(pose=Pose2D(0.0, 0.0))
    timer = Timer(robot)
    timer.restart()
    watch = ObjectWatch(robot, WantedObject("red", None), timer)
    seen = Detection("red", 0.1, (2.0, 0.0), 0.05, 0.3, 0.3, (0, 0, 9, 9))

    def look(time, *objects):
        robot.time, robot.picture, robot.objects = time, Image(time, PIXELS, MODEL), objects
        return watch.update()

    assert look(0.1, seen) == []
    assert look(0.1, seen) == []  # the same picture again
    elsewhere = replace(seen, stamp=0.3, position=(2.0, 1.5))
    assert look(0.3, elsewhere) == []
    (found,) = look(0.5, replace(seen, stamp=0.5, position=(2.1, 0.0)))
    assert (found.x, found.y) == pytest.approx((2.05, 0.0))
    assert found.pictures == 2 and found.deviation < 0.05


def test_it_stops_before_the_object_and_faces_it():
    robot = SeeingRobot(things=[("red", 4.0, 1.0)], pose=Pose2D(2.0, 0.0))
    behaviour = ApproachObject(colour="red", distance=0.25)
    assert tick(behaviour, robot, 60.0) is Status.SUCCESS
    at = Pose2D(4.0, 1.0).relative_to(robot.pose)
    assert hypot(at.x, at.y) - robot.footprint.front == pytest.approx(0.25, abs=0.03)
    assert abs(atan2(at.y, at.x)) < 0.06
    assert behaviour.gap == pytest.approx(0.25, abs=0.03)
    assert len(robot.goals) == 1


def test_it_tries_other_sides_of_the_object():
    robot = SeeingRobot(things=[("red", 2.0, 0.0)])
    robot.unreachable = 2
    behaviour = ApproachObject(colour="red")
    assert tick(behaviour, robot, 60.0) is Status.SUCCESS
    sides = [atan2(goal.y, goal.x - 2.0) for goal in robot.goals]
    assert np.abs(sides) == pytest.approx([pi, pi - 0.6, pi - 0.6], abs=1e-6)


def test_all_sides_closed_is_the_failure_of_the_last_drive():
    robot = SeeingRobot(things=[("red", 2.0, 0.0)], unreachable=99)
    behaviour = ApproachObject(colour="red")
    assert tick(behaviour, robot, 60.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.NO_VALID_PATH
    assert len(robot.goals) == 8


def test_an_object_that_is_gone_is_not_found():
    robot = SeeingRobot()
    behaviour = ApproachObject(colour="red", object=Pose2D(2.0, 0.0))
    assert tick(behaviour, robot, 60.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.OBJECT_NOT_FOUND


def test_another_object_of_the_colour_is_not_taken_for_it():
    robot = SeeingRobot(things=[("red", 1.5, 1.0)])
    behaviour = ApproachObject(colour="red", object=Pose2D(2.0, -1.0))
    assert tick(behaviour, robot, 60.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.OBJECT_NOT_FOUND


@pytest.mark.parametrize("kind", [FindObject, ApproachObject])
def test_a_label_of_the_object_detector_is_searched_instead_of_a_colour(kind):
    robot = SeeingRobot(things=[("chair", 1.5, 1.0), ("red", 0.5, 0.0)], has_camera=True)
    behaviour = kind(label="chair")
    assert tick(behaviour, robot, 60.0) is Status.SUCCESS
    at = Pose2D(1.5, 1.0).relative_to(robot.pose)
    assert abs(atan2(at.y, at.x)) < 0.6


@pytest.mark.parametrize("kind", [FindObject, ApproachObject])
def test_a_silent_detector_is_a_failure(kind):
    robot = SeeingRobot(has_camera=False, views=[view(1.0, 0.0)])
    more = {"object": Pose2D(2.0, 0.0)} if kind is ApproachObject else {}
    behaviour = kind(label="chair", **more)
    assert tick(behaviour, robot, 30.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.NO_IMAGE
    assert behaviour.failure.sentence == "the object detector gave no result for 3 s"


def test_a_label_that_is_not_there_is_not_found():
    behaviour = FindObject(label="chair")
    robot = SeeingRobot(things=[("red", 1.0, 0.0)])
    assert tick(behaviour, robot, 60.0) is Status.FAILURE
    assert "no chair within 4 m of 1 places" in behaviour.failure.sentence
