"""Markers in the particle filter and in dead reckoning: corridors, twin rooms, false markers."""

from dataclasses import replace
from math import hypot, pi

import numpy as np
import pytest

from stack.components import Estimator
from stack.drivetrain.description import OdometryNoise
from stack.frames.buffer import TransformBuffer
from stack.localisation.dead_reckoning import DeadReckoning
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import DeadReckoningParameters, LocaliserParameters
from stack.types import (
    STANDSTILL,
    Marker,
    MarkerFix,
    Observation,
    Odometry,
    Pose2D,
    PoseCandidate,
)
from tests.stack.localisation.drawn_office import Place, along, drawn, mapped, office, twin_rooms
from tests.stack.navigation.toy_world import robot

MARKER = Marker(3, 0.2, (0.0, 0.0, 0.4), 0.0)
FIX = np.diag(np.square([0.04, 0.04, 0.02]))
PERIOD, LATENCY = 0.1, 0.1
SCALE = 1.03
"""Of the odometry: 3 cm too far in each metre."""


def corridor() -> Place:
    """40 m by 1.6 m, without anything on its walls; the lidar reaches 12 m."""
    walls = [(0.0, 0.0, 40.0, 0.1), (0.0, 1.7, 40.0, 1.8), (0.0, 0.0, 0.1, 1.8),
             (39.9, 0.0, 40.0, 1.8)]  # fmt: skip
    solid = drawn(walls, 40.0, 1.8)
    return Place(solid, mapped(solid))


def fix(stamp: float, *poses: Pose2D, shares=None) -> MarkerFix:
    shares = shares or [1.0 / len(poses)] * len(poses)
    found = (PoseCandidate(p, 0.3, FIX, share) for p, share in zip(poses, shares, strict=True))
    return MarkerFix(stamp, (MARKER,), tuple(found))


class Drive:
    """An estimator that drives with a scale error of the odometry and scans at 10 Hz."""

    def __init__(self, place: Place | None, estimator: Estimator, seed: int = 0) -> None:
        self.place, self.estimator = place, estimator
        self.generator = np.random.default_rng(seed)
        self.frames, self.odometry, self.time = TransformBuffer(), Pose2D(0.0, 0.0), 0.0
        self.truth = {0.0: Pose2D(0.0, 0.0)}

    def step(self, pose: Pose2D, moved: Pose2D) -> None:
        """Move to a true pose; update the estimator."""
        self.time = round(self.time + PERIOD, 6)
        self.odometry = self.odometry.compose(Pose2D(SCALE * moved.x, 0.0, moved.heading))
        self.frames.add(Odometry(self.time, self.odometry, STANDSTILL))
        scans = {}
        if self.place is not None:
            scans["lidar"] = self.place.scan(pose, self.time, self.generator)
        self.truth[self.time] = pose
        self.estimator.update(Observation(self.time, scans), self.frames)

    def sees(self, *others: Pose2D, error: float = 0.0) -> None:
        """A picture that was exposed LATENCY ago arrives, with the true pose among others."""
        stamp = round(self.time - LATENCY, 6)
        right = self.truth[stamp]
        right = Pose2D(right.x + error, right.y, right.heading)
        self.estimator.update_markers(fix(stamp, right, *others), self.frames)

    @property
    def error(self) -> float:
        return self.estimator.estimate.pose.distance_to(self.truth[self.time])

    @property
    def contains(self) -> bool:
        """Whether the 95 % ellipse contains the truth."""
        estimate, truth = self.estimator.estimate, self.truth[self.time]
        off = np.array([estimate.pose.x - truth.x, estimate.pose.y - truth.y])
        return bool(off @ np.linalg.solve(estimate.covariance[:2, :2], off) <= 5.991)


def localiser(place: Place, seed: int = 0) -> Localiser:
    return Localiser(LocaliserParameters(), robot(), place.grid, seed)


def start(drive: Drive, pose: Pose2D) -> None:
    drive.estimator.start(pose)
    drive.step(pose, Pose2D(0.0, 0.0))


def through_the_corridor(*, markers: bool) -> Drive:
    """From x = 2 m to x = 23 m; a marker is seen every 7 m or never."""
    place = corridor()
    drive = Drive(place, localiser(place))
    start(drive, Pose2D(2.0, 0.9, 0.0))
    for n, (pose, moved) in enumerate(along([(2.0, 0.9), (23.0, 0.9)], 0.0, 0.7, PERIOD)):
        drive.step(pose, moved)
        if markers and n % 100 in (97, 98, 99):
            drive.sees(Pose2D(pose.x + 1.0, pose.y, 0.5))
    return drive


def test_a_marker_corrects_the_drift_along_a_bare_corridor():
    """Both ends are out of the lidar's range (12 m) from x = 12 m to 23 m: 3 % of 11 m are 0.33 m.

    The last marker is seen at 23 m.
    """
    without, aided = through_the_corridor(markers=False), through_the_corridor(markers=True)
    assert without.error > 0.25
    assert aided.error < 0.1
    assert aided.contains
    deviations = [one.estimator.estimate.position_deviation for one in (without, aided)]
    assert deviations[1] < 0.1 < deviations[0]


def test_a_false_marker_does_not_move_the_pose():
    """Three pictures say 3 m elsewhere, in the open office where the scans say where it is."""
    place = office()
    drive = Drive(place, localiser(place))
    start(drive, Pose2D(2.0, 2.5, 0.6))
    for pose, moved in along([(2.0, 2.5), (2.05, 4.5), (5.0, 4.5)], 0.6, 0.5, PERIOD):
        drive.step(pose, moved)
        if drive.time in (3.0, 3.4, 3.8):
            stamp = round(drive.time - LATENCY, 6)
            drive.estimator.update_markers(fix(stamp, Pose2D(8.0, 4.5, 0.0)), drive.frames)
        assert drive.error < 0.15
    assert drive.estimator.estimate.is_good


def test_markers_tell_rooms_apart_that_the_lidar_cannot():
    """A search finds two equal rooms; two views of a marker leave the right one."""
    place = twin_rooms()
    drive = Drive(place, localiser(place))
    drive.estimator.start(None)
    true = Pose2D(7.2, 1.5, 0.3)
    drive.step(true, Pose2D(0.0, 0.0))
    for _ in range(12):  # turning on the spot until both rooms are compared
        true = Pose2D(true.x, true.y, true.heading + 0.2)
        drive.step(true, Pose2D(0.0, 0.0, 0.2))
    assert drive.estimator.estimate.ambiguous
    for _ in range(3):
        true = true.compose(Pose2D(0.05, 0.0, 0.1))
        drive.step(true, Pose2D(0.05, 0.0, 0.1))
        drive.step(true, Pose2D(0.0, 0.0))
        drive.sees()
    assert drive.error < 0.1
    assert not drive.estimator.estimate.ambiguous


def test_a_kidnap_into_an_equal_room_is_noticed_by_markers():
    """The scans are the same in both rooms; markers that contradict the pose add the other one."""
    place = twin_rooms()
    drive = Drive(place, localiser(place))
    start(drive, Pose2D(2.15, 1.5, 0.3))
    true = Pose2D(2.15 + 5.05, 1.5, 0.3)
    for _ in range(12):
        true = true.compose(Pose2D(0.05, 0.0, 0.15))
        drive.step(true, Pose2D(0.05, 0.0, 0.15))
        drive.step(true, Pose2D(0.0, 0.0))
        drive.sees()
    assert drive.error < 0.15


def test_mirrored_candidates_are_resolved_by_the_prior():
    place = corridor()
    drive = Drive(place, localiser(place))
    start(drive, Pose2D(10.0, 0.9, 0.0))
    drive.step(Pose2D(10.0, 0.9, 0.0), Pose2D(0.0, 0.0))
    drive.sees(Pose2D(10.8, 1.2, 0.6))
    assert drive.error < 0.1


def test_dead_reckoning_with_markers_does_not_drift():
    """30 m with 3 % scale error, a marker every 7 m: at most 7 m of drift, 21 cm."""
    errors = []
    slipping = replace(robot(), odometry=OdometryNoise(slip=0.063))
    drive = Drive(None, DeadReckoning(DeadReckoningParameters(), slipping, None, 0))
    start(drive, Pose2D(0.0, 0.0))
    for n, (pose, moved) in enumerate(along([(0.0, 0.0), (30.0, 0.0)], 0.0, 0.7, PERIOD)):
        drive.step(pose, moved)
        if n % 100 in (98, 99):
            drive.sees()
        errors.append(drive.error)
    assert max(errors) < 0.3
    assert hypot(drive.odometry.x - pose.x, drive.odometry.y - pose.y) > 0.8
    assert drive.estimator.estimate.corrected_at == pytest.approx(39.9, abs=3.0)


def test_estimators_without_markers_keep_their_estimate():
    """The default of the base class: a capability that an estimator states."""

    class Fixed(DeadReckoning):
        uses_markers = False
        update_markers = Estimator.update_markers

    estimator = Fixed(DeadReckoningParameters(), robot(), None, 0)
    estimator.start(Pose2D(1.0, 2.0, pi / 2))
    assert estimator.update_markers(fix(0.0, Pose2D(5.0, 5.0)), TransformBuffer()).pose.x == 1.0
    assert not Estimator.uses_markers
