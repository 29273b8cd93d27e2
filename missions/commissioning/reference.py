"""Reference trajectory: poses of a robot by its lidar, without ground truth.

Each scan is matched with a map of the place that the scans themselves draw. Odometry only predicts
where a match begins, and corrects scans for the motion during their rotation.
"""

from __future__ import annotations

from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.frames.deskew import Deskewer
from stack.localisation.fusion.wheels_gyro import WheelGyroOdometry
from stack.localisation.parameters import OdometryFusionParameters
from stack.mapping.slam.mapper import Mapper
from stack.perception.own_body import OwnBody
from stack.types import FloatArray, Observation, Pose2D, Scan

CLEAR_MATCH = 0.6
"""Share of a scan's points that a match explains; other poses are those of odometry."""


class Reference:
    """Poses of the base by the scans of one lidar.

    Args:
        robot: its description.
        lidar: name of the lidar.

    Attributes:
        points: (n, 2) what the newest scan shows, base frame at its stamp, metres.
        trajectory: stamp and pose of each scan that matched; the first pose is the origin.
    """

    def __init__(self, robot: RobotDescription, lidar: str) -> None:
        self._robot, self._lidar = robot, lidar
        self._odometry = WheelGyroOdometry(OdometryFusionParameters(), robot)
        self._frames, self._deskewer, self._own = TransformBuffer(), Deskewer(), OwnBody(robot)
        self.mapper = Mapper(noise=robot.range_noise(lidar))
        self._moved, self._at_scan = Pose2D(0.0, 0.0), Pose2D(0.0, 0.0)
        self._pose = Pose2D(0.0, 0.0)
        self.points: FloatArray | None = None
        self.trajectory: list[tuple[float, Pose2D]] = []

    @property
    def pose(self) -> Pose2D:
        """Pose of the base now: that of the newest scan, and the odometry since."""
        return self._pose.compose(self._moved.relative_to(self._at_scan))

    def keep_map(self) -> None:
        """Add no more scans to the map: all of the place has been seen."""
        self.mapper.set_mapping(False)

    def update(self, observation: Observation) -> None:
        """Process the measurements of one step."""
        odometry = self._odometry.update(with_calibrated_gyro(observation, self._robot))
        self._frames.add(odometry)
        self._moved = odometry.pose
        observation = self._deskewer.update(self._own.removed(observation), self._frames)
        scan = observation.named(self._lidar, Scan)
        if scan is None or not self._frames.covers(scan.stamp):
            return
        at = self._frames.pose_at("odom", scan.stamp)
        self._pose, self._at_scan = self.mapper.add(scan.stamp, at, scan), at
        self.points = scan.points()
        match = self.mapper.match
        if match is None or match.overlap >= CLEAR_MATCH:
            self.trajectory.append((scan.stamp, self._pose))


def with_calibrated_gyro(observation: Observation, robot: RobotDescription) -> Observation:
    """Return the observation with yaw rates as the robot file calibrates them."""
    if robot.imu is None or observation.imu is None:
        return observation
    corrected = robot.imu.corrected(observation.imu)
    return Observation(observation.time, {**observation.measurements, "imu": corrected})
