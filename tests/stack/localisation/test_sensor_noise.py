"""Estimators take the noise of sensors and wheels from the robot file, and stay calibrated."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from missions.execution.running import run_mission
from missions.run_options import RunOptions
from robots.load import find_robot, read_robot
from stack.localisation.fusion.ekf import EkfOdometry
from stack.localisation.fusion.parameters import EkfParameters
from stack.localisation.health_model import RIGHT_DISTANCE
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.mapping.slam.estimator import SlamEstimator
from stack.mapping.slam.parameters import SlamParameters
from stack.telemetry.sinks import Sink
from stack.types import Imu, Odometry, Pose2D, Twist
from tests.observed import observed
from tests.stack.localisation.drawn_office import office

SCOUT = find_robot("scout", Path())


def scout(folder: Path, factor: float) -> Path:
    """Write the scout with other lidar, gyro and wheels: their noise times a factor."""
    document = yaml.safe_load(SCOUT.read_text())
    document["urdf"] = str(SCOUT.parent / "scout.urdf")
    document["odometry"]["slip"] = 0.02 * factor
    document["lidar"]["noise"] = 0.01 * factor
    document["imu"]["gyro_noise"] = 0.004 * factor
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(document))
    return path


class Observed(Sink):
    """Health and error of the estimate, 10 times a second."""

    def __init__(self) -> None:
        self.healths: list[float] = []
        self.errors: list[float] = []

    def wants_snapshot(self, time: float) -> bool:
        return round(20.0 * time) % 2 == 0

    def snapshot(self, snapshot) -> None:
        self.healths.append(snapshot.health)
        self.errors.append(snapshot.pose.distance_to(snapshot.truth))


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
def test_the_health_of_a_drive_is_calibrated_whatever_the_noise(tmp_path, factor):
    """Brier's score of a forecast of 0.8 that comes true is 0.04."""
    seen = Observed()
    options = RunOptions(seed=1, robot=str(scout(tmp_path, factor)))
    report = run_mission("01_drive_to_a_point", options, [seen])
    assert report.status == "success"
    right = np.array(seen.errors) < RIGHT_DISTANCE
    assert right.size > 50 and right.all()
    assert np.mean(np.square(np.array(seen.healths) - right)) < 0.04


def turned_by_noise(robot) -> float:
    """The variance of the heading of a step of 50 ms, after 20 s that fix the bias, rad²."""
    odometry, rest = EkfOdometry(EkfParameters(scan_matching=False), robot), np.zeros((5, 3))
    for step in range(402):
        now, ahead = 0.05 * step, 0.005 * (step > 400)
        imu = Imu(now - 0.04 + 0.01 * np.arange(5), rest, rest)
        wheels = Odometry(now, Pose2D(ahead, 0.0), Twist(ahead / 0.05, 0.0))
        found = odometry.update(observed(now, wheels=wheels, imu=imu))
    return float(found.step_covariance[2, 2])


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
def test_a_robot_file_with_other_noise_changes_what_the_estimators_use(tmp_path, factor):
    robot = read_robot(scout(tmp_path, factor))
    added = 0.01**2 * (factor**2 - 1.0)
    place = office()
    localiser = Localiser(LocaliserParameters(), robot, place.grid, 0)
    assert localiser.map.evaluator.deviation**2 == pytest.approx(0.08**2 + added)
    scan = place.scan(Pose2D(2.0, 2.5), 0.0, np.random.default_rng(0))
    slam = SlamEstimator(SlamParameters(), robot, None, 0)
    slam.mapper.add(0.0, Pose2D(0.0, 0.0), scan)
    assert slam.mapper.prepared(0).deviation ** 2 == pytest.approx(0.03**2 + added)
    # 0.004 rad/s at 100 Hz, and 4e-8 rad²/s for the stamps
    variance = 0.05 * ((0.004 * factor) ** 2 / 100.0 + 4e-8)
    assert turned_by_noise(robot) == pytest.approx(variance, rel=0.05)
