"""Driving without a map: the pose is odometry placed at the initial pose."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from stack.drivetrain.description import ImuDescription, OdometryNoise
from stack.errors import NavigationError
from stack.localisation.dead_reckoning import DeadReckoning
from stack.localisation.parameters import DeadReckoningParameters
from stack.types import Pose2D, Scan
from tests.stack.navigation.toy_world import robot

DISTANCE_VARIANCE = 0.02**2 / 2.0
"""Of the mean of two wheels with the default slip of 2 %, m²/m."""
SCAN = Scan(0.0, np.full(4, np.inf, np.float32), 0.0, 0.1, 0.1, 10.0)


def started_at(pose):
    estimator = DeadReckoning(DeadReckoningParameters(), robot(), None, 0)
    estimator.start(pose)
    return estimator


def test_the_map_frame_is_the_odom_frame_at_the_initial_pose():
    estimator = started_at(Pose2D(-2.25, 3.0, pi / 2))
    assert estimator.estimate.pose == Pose2D(-2.25, 3.0, pi / 2)
    estimator.follow(Pose2D(5.0, 1.0, 0.0))  # wherever odometry begins to count
    assert estimator.estimate.pose == Pose2D(-2.25, 3.0, pi / 2)
    estimator.follow(Pose2D(7.0, 1.0, 0.0))  # two metres forward, which is north
    pose = estimator.estimate.pose
    assert (pose.x, pose.y, pose.heading) == pytest.approx((-2.25, 5.0, pi / 2))
    assert estimator.estimate.health == 1.0
    assert estimator.particles.shape == (0, 3)


def deviation_after(steps: int) -> float:
    estimator = started_at(Pose2D(0.0, 0.0))
    for step in range(steps + 1):
        estimator.follow(Pose2D(4.0 * step / steps, 0.0))
    return float(sqrt(estimator.estimate.covariance[0, 0]))


def test_the_deviation_on_a_straight_grows_with_the_root_of_the_distance():
    assert deviation_after(1) == pytest.approx(sqrt(4.0 * DISTANCE_VARIANCE))
    assert deviation_after(100) == pytest.approx(deviation_after(1))


def test_heading_uncertainty_becomes_lateral_position_uncertainty():
    estimator = started_at(Pose2D(0.0, 0.0, pi / 2))
    estimator.follow(Pose2D(0.0, 0.0))
    estimator.set_pose(Pose2D(0.0, 0.0, pi / 2), 0.0, 0.1)
    estimator.follow(Pose2D(2.0, 0.0))  # 2 m along y: 0.1 rad are 0.2 m along x
    covariance = estimator.estimate.covariance
    assert covariance[0, 0] == pytest.approx(0.2**2 + 2.0 * DISTANCE_VARIANCE)
    assert covariance[1, 1] == pytest.approx(2.0 * DISTANCE_VARIANCE)


def test_standstill_adds_no_uncertainty_and_a_set_pose_holds():
    estimator = started_at(Pose2D(0.0, 0.0))
    estimator.follow(Pose2D(1.0, 2.0, 0.5))
    estimator.set_pose(Pose2D(8.0, 9.0, 1.0), 0.3, 0.2)
    estimator.follow(Pose2D(1.0, 2.0, 0.5))
    assert estimator.estimate.pose.distance_to(Pose2D(8.0, 9.0)) < 1e-12
    assert np.allclose(estimator.estimate.covariance, np.diag([0.09, 0.09, 0.04]))


def test_global_relocalisation_fails_without_a_map():
    estimator = started_at(Pose2D(0.0, 0.0))
    assert estimator.fit_at(Pose2D(1.0, 1.0), SCAN) == 0.0
    with pytest.raises(NavigationError, match=r"LOST: .*needs a map.*add a map"):
        estimator.localise_globally(SCAN)


@pytest.mark.parametrize("slip", [0.01, 0.02, 0.08])
def test_the_drift_follows_from_the_slip_in_the_robot_file(slip):
    """The mean of two wheels has half the variance of one; without a gyro they also turn."""
    rover = replace(robot(), odometry=OdometryNoise(slip=slip))
    deviations = []
    for imu in (None, ImuDescription()):
        described = replace(rover, imu=imu)
        estimator = DeadReckoning(DeadReckoningParameters(), described, None, 0)
        for x in (0.0, 1.0):
            estimator.follow(Pose2D(x, 0.0))
        covariance = estimator.estimate.covariance
        assert covariance[0, 0] == pytest.approx(slip**2 / 2.0)
        deviations.append(sqrt(covariance[2, 2]))
    assert deviations[0] == pytest.approx(sqrt(2.0) * slip / 0.35, rel=0.1)  # track 35 cm
    assert deviations[1] == pytest.approx(sqrt(1e-5))
