from dataclasses import replace
from math import pi
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.errors import NavigationError, ParameterError
from stack.navigation.capabilities.limbs import ArmStage
from stack.navigation.capabilities.localisation import StackLocalisation
from stack.navigation.capabilities.map import StackMap
from stack.navigation.capabilities.perception import StackPerception
from stack.navigation.capabilities.robot import StackRobot
from stack.navigation.capabilities.surroundings import Surroundings
from stack.navigation.live_parameters import LiveParameters
from stack.navigation.plans.arm_plans import ArmPlans
from stack.perception.blocks import BlockDetector
from stack.perception.calibration_watch import CalibrationWatch
from stack.perception.camera_lease import CameraLease
from stack.types import (
    Battery,
    CameraModel,
    FailureCode,
    Image,
    Marker,
    MarkerSighting,
    Perceived,
    Pose2D,
    PoseEstimate,
    RivalPose,
    TaskStatus,
)
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyWorld, robot, room

CAMERA = CameraModel(4, 4, 4.0, (0.0, 0.0, 0.3))


class Match:
    def __init__(self, pose, fit):
        self.pose, self.fit = pose, fit


class ToyEstimator:
    """Believes to be `error` away from the truth until it is started or relocalised."""

    grid, unmapped = None, ""

    def map_files(self):
        return {}

    def __init__(self, world):
        self.world, self.error, self.started, self.views = world, Pose2D(0, 0), [], None
        self.fails, self.lidar, self.rivals = None, world.lidar, ()

    @property
    def estimate(self):
        pose = self.world.pose.compose(self.error)
        return PoseEstimate(pose, np.eye(3) * 1e-4, 0.9, rivals=self.rivals)

    def set_pose(self, pose, position_deviation, heading_deviation):
        self.started.append((pose, position_deviation, heading_deviation))
        self.error = pose.relative_to(self.world.pose)

    def fit_at(self, pose, scan):
        return max(0.0, 1.0 - pose.distance_to(self.world.pose))

    def localise_globally(self, scan, earlier=()):
        self.views = (scan, earlier)
        if self.fails:
            raise self.fails
        self.error = Pose2D(0, 0)
        return Match(self.world.pose, 0.87)


class ToyStore:
    def save(self, image, name, details=None):
        return f"images/{name}.png"


class ToyMapStore:
    """Keeps saved maps in memory."""

    def __init__(self):
        self.saved = {}

    def save(self, name, files):
        self.saved[name] = files
        return name

    def find(self, name):
        return Path(name)


class ToyDetector:
    def __init__(self):
        self.looked_at = []

    def sightings(self, image):
        self.looked_at.append(image.stamp)
        return (MarkerSighting(image.stamp, MARKER, 1.0, ()),)


MARKER = Marker(7, 0.2, (5.0, 3.0, 0.4), pi)


class Rig:
    """A pilot in a toy world, stepped as the runtime steps it."""

    def __init__(self):
        world = self.world = ToyWorld(room(8, 6), robot(), Pose2D(1.0, 3.0))
        self.estimator, self.detector = ToyEstimator(world), ToyDetector()
        self.covered, self.measurements, self.maps = [], {}, ToyMapStore()

        def cover(poses):
            self.covered.append(list(poses))

        toy = self.toy = ToyDrive(world, estimator=self.estimator, cover=cover)
        self.camera, navigator, self.now = CameraLease(), toy.navigator, toy.now
        self.tuning = LiveParameters(
            {
                "controller": toy.follower,
                "navigation": navigator.tools,
                "safety": toy.safety,
            },
            toy.emit,
        )
        self.base = navigator.base
        self.localisation = StackLocalisation(
            self.estimator, navigator, world.frames, toy.now, toy.emit
        )
        seen = SimpleNamespace(local_costmap=toy.local, global_costmap=toy.globe)
        self.map = StackMap(
            world.robot, self.estimator, seen, None, self.maps, toy.emit,
            markers=(MARKER,),
        )  # fmt: skip
        self.perception = StackPerception(
            robot=world.robot, now=toy.now, frames=world.frames, estimator=self.estimator,
            camera=self.camera, depth_camera=CameraLease(), objects=None, places=None,
            detector=self.detector, lines=None, coloured=None,
            block_detector=BlockDetector(np.eye(4)), calibration=CalibrationWatch(), emit=toy.emit,
        )  # fmt: skip
        plans = ArmPlans(world.robot, 0, print, is_real_time=False)
        self.robot = StackRobot(
            self.base, self.localisation, self.map, self.perception, world, toy.now, ToyStore(),
            toy.emit,
            ArmStage(world.robot, toy.now, plans, Surroundings(()), CameraLease(), toy.emit),
        )  # fmt: skip

    def step(self, image=None):
        world = self.world
        newest = {"lidar": world.scan, "battery": Battery(0.5), "camera": image}
        self.measurements |= {name: item for name, item in newest.items() if item}
        estimate = replace(world.estimate, rivals=self.estimator.rivals)
        perceived = Perceived(
            world.time, estimate, world.odometry, world.obstacles, measurements=self.measurements
        )
        self.now.see(perceived)
        twist = self.toy.navigator.step(perceived).twist
        world.drive(self.toy.safety.limit(twist, world.odometry, world.obstacles))
        return twist

    def run(self, seconds):
        return [self.step() for _ in range(round(seconds / 0.05))]

    def finish(self, task, seconds=30.0):
        while task.status is TaskStatus.RUNNING and self.world.time < seconds:
            self.step()
        return task.status

    def picture(self):
        return Image(self.world.time, np.zeros((4, 4, 3), np.uint8), CAMERA)

    def last(self, kind):
        return [event for event in self.toy.events if event[0] == kind][-1]


@pytest.fixture
def rig():
    made = Rig()
    yield made
    made.toy.navigator.close()


def test_what_the_sensors_say_is_passed_on(rig):
    assert (rig.robot.battery.charge, rig.perception.scan) == (1.0, None)
    rig.step()
    assert rig.robot.battery == Battery(0.5)
    assert rig.perception.scan is not None
    assert rig.robot.time == rig.world.time
    motion = rig.now.perceived.motion
    assert (rig.base.odometry, rig.base.speed) == (motion.pose, motion.twist)
    assert rig.localisation.pose == rig.world.pose
    assert (rig.base.footprint, rig.map.markers) == (rig.world.robot.footprint, (MARKER,))


NEAR, FAR = Pose2D(2.0, 3.0), Pose2D(3.0, 3.0)


@pytest.mark.parametrize(
    ("ask", "poses"),
    [
        (lambda p: p.navigate_to(FAR), [FAR]),
        (lambda p: p.navigate_through([NEAR, FAR]), [NEAR, FAR]),
        (lambda p: p.plan(FAR), [FAR]),
    ],
)
def test_the_ground_of_the_costmaps_is_made_to_hold_every_goal(rig, ask, poses):
    ask(rig.base)
    assert rig.covered == [poses]


def test_asking_for_a_picture_keeps_the_camera_on_for_a_second(rig):
    assert not rig.camera.is_active(rig.world.time)
    assert rig.perception.image() is None
    rig.run(0.95)
    assert rig.camera.is_active(rig.world.time)
    rig.run(0.1)
    assert not rig.camera.is_active(rig.world.time)


def test_a_picture_from_before_the_camera_was_off_is_not_handed_out(rig):
    rig.perception.image()
    picture = rig.picture()
    rig.step(picture)
    assert rig.perception.image() is picture
    rig.run(0.9)
    assert rig.perception.image() is picture
    rig.run(2.0)
    assert rig.perception.image() is None


def test_markers_are_those_of_the_newest_picture(rig):
    assert rig.perception.marker_sightings() == ()
    assert rig.camera.is_active(rig.world.time)
    rig.step(rig.picture())
    assert [s.marker.number for s in rig.perception.marker_sightings()] == [7]
    rig.step(rig.picture())
    rig.perception.marker_sightings()
    assert set(rig.detector.looked_at) == {0.0, 0.05}


def test_costmaps_are_cleared_by_name(rig):
    for which in ("local", "global", "both"):
        rig.map.clear_costmap(which)
    assert (rig.toy.local.cleared, rig.toy.globe.cleared) == (2, 2)
    with pytest.raises(ParameterError, match="'lokal' is not one of local, global, both") as error:
        rig.map.clear_costmap("lokal")
    assert "did you mean 'local'" in error.value.hint


def test_a_costmap_is_cleared_around_the_robot_or_in_one_layer(rig):
    rig.map.clear_costmap("local", radius=1.5, layer="obstacle")
    assert rig.toy.local.cleared_around == (rig.localisation.pose, 1.5, "obstacle")
    with pytest.raises(ParameterError, match="unknown layer 'obstacles'") as error:
        rig.map.clear_costmap("both", layer="obstacles")
    assert "did you mean 'obstacle'" in error.value.hint


def test_setting_the_pose_emits_an_event_with_source_and_jump(rig):
    rig.localisation.set_pose(
        Pose2D(4.0, 3.0, pi / 2), position_deviation=0.2, heading_deviation=0.1, source="marker"
    )
    assert rig.estimator.started == [(Pose2D(4.0, 3.0, pi / 2), 0.2, 0.1)]
    _, text, fields = rig.last("relocalised")
    assert fields == {"by": "marker", "jump": 3.0, "turn": round(pi / 2, 4)}
    assert text == "now at (4.00, 3.00, 90 deg) by marker, 3.00 m and 90 deg from the previous pose"


def test_relocalising_stands_gathers_scans_and_sets_the_pose(rig):
    rig.base.navigate_to(Pose2D(6.0, 3.0))
    rig.run(2.0)
    rig.estimator.error = Pose2D(2.0, 0.0, 0.0)
    stopped_from = rig.world.time
    task = rig.localisation.relocalise()
    assert rig.finish(task) is TaskStatus.SUCCEEDED
    newest, earlier = rig.estimator.views
    stamps = [*(scan.stamp for _, scan in earlier), newest.stamp]
    assert len(set(stamps)) == 3
    assert stamps[0] > stopped_from + 0.3  # not one from while it still rolled
    _, _, fields = rig.last("relocalised")
    assert (fields["by"], fields["jump"]) == ("lidar", pytest.approx(2.0, abs=1e-3))
    assert "87% of the scans" in task.feedback


def test_relocalising_fails_rather_than_guess(rig):
    rig.estimator.fails = NavigationError(FailureCode.AMBIGUOUS, "(1.00, 1.00) and (5.00, 1.00)")
    task = rig.localisation.relocalise()
    rig.finish(task)
    assert task.failure.code == FailureCode.AMBIGUOUS
    assert task.failure.sentence == "(1.00, 1.00) and (5.00, 1.00)"
    assert rig.estimator.started == []


def test_a_search_that_leaves_rivals_is_ambiguous(rig):
    rig.estimator.rivals = (RivalPose(Pose2D(5.0, 1.0), 0.4),)
    task = rig.localisation.relocalise()
    rig.finish(task)
    assert task.failure.code == FailureCode.AMBIGUOUS
    assert "and another place, (5.00, 1.00), explain the scans about as well" in (
        task.failure.sentence
    )
    assert rig.last("relocalised")  # the estimate is the best of them


def test_a_goal_begins_with_disambiguation_while_there_are_rivals(rig):
    rig.estimator.rivals = (RivalPose(Pose2D(5.0, 1.0), 0.4),)
    task = rig.base.navigate_to(Pose2D(3.0, 3.0))
    rig.run(0.2)
    assert task.feedback == "1 rival left, looking"
    rig.estimator.rivals = ()
    rig.run(2.0)
    navigator, evaded = rig.toy.navigator, []
    assert navigator.local_plan is not None  # the drive's, though it began with a search
    step = navigator.evasion.step
    navigator.evasion.step = lambda wanted, now: evaded.append(now.path) or step(wanted, now)
    rig.run(0.2)
    assert min(map(len, evaded)) > 1  # evasion knows the way ahead
    assert rig.finish(task) is TaskStatus.SUCCEEDED
    assert rig.world.pose.distance_to(Pose2D(3.0, 3.0)) < 0.3


def test_relocalising_without_scans_ends(rig):
    rig.world.frozen_scan = True
    task = rig.localisation.relocalise()
    rig.finish(task)
    assert task.failure.code == FailureCode.LOST
    assert "of 3 lidar scans while standing still within 5 s" in task.failure.sentence


def test_fit_at_asks_with_the_newest_scan(rig):
    assert rig.localisation.fit_at(rig.world.pose) == 0.0
    rig.step()
    assert rig.localisation.fit_at(rig.world.pose) == 1.0


def test_pictures_and_words_are_passed_on(rig):
    assert rig.robot.save_image(rig.picture(), "shelf") == "images/shelf.png"
    rig.robot.say("hello")
    assert rig.last("say")[1] == "hello"


def test_parameters_change_between_steps(rig):
    before = rig.tuning.current()
    assert before["controller.cruise_speed"] == PurePursuitParameters().cruise_speed
    assert {"navigation.patience", "safety.padding"} <= before.keys()
    table = {item.name: item for item in rig.tuning.table.parameters}
    assert table.keys() == before.keys()
    assert {name: item.start for name, item in table.items()} == before
    assert table["navigation.patience"].public and table["navigation.patience"].unit == "s"
    assert not table["navigation.look_ahead"].public
    rig.tuning.change("controller.cruise_speed", "30 cm/s")
    assert rig.tuning.current()["controller.cruise_speed"] == pytest.approx(0.3)
    rig.tuning.change("navigation.patience", 7)
    assert rig.toy.navigator.tools.parameters.patience == 7.0
    rig.base.navigate_to(Pose2D(6.0, 3.0))
    assert max(twist.linear for twist in rig.run(6.0)) == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("controler.cruise_speed", 0.3, "unknown component 'controler'"),
        ("controller.cruise", 0.3, "controller has no parameter 'cruise'"),
        ("controller.cruise_speed", -1.0, "-1 m/s must be above 0 m/s"),
        ("controller.cruise_speed", "fast", "expected a number in m/s"),
        ("cruise_speed", 0.3, "unknown component 'cruise_speed'"),
    ],
)
def test_invalid_parameters_are_refused(rig, name, value, message):
    before = rig.tuning.current()
    with pytest.raises(ParameterError, match=message):
        rig.tuning.change(name, value)
    assert rig.tuning.current() == before


def test_the_map_is_what_the_costmap_has_sensed_and_is_saved(rig):
    assert rig.map.known_area > 0.0
    grid = rig.map.grid
    assert grid is rig.map.grid  # the same until the costmap changes
    assert rig.map.save("flat") == "flat"
    assert set(rig.maps.saved["flat"]) == {"map.yaml", "map.pgm"}
    assert rig.last("map")[1].startswith("saved the map as flat")
    plan = rig.map.coverage([Pose2D(2, 2), Pose2D(5, 2), Pose2D(5, 4), Pose2D(2, 4)], 0.4)
    assert len(plan.lanes) >= 4


def test_a_map_is_not_loaded_by_an_estimator_that_cannot_change_it(rig, tmp_path):
    with pytest.raises(NavigationError, match="cannot load '"):
        rig.map.load(str(tmp_path / "nowhere" / "map.yaml"))
