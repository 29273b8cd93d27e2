"""World model: who walks is left out of the costmaps, and who has stood for long is not."""

from math import inf, pi

import numpy as np
import pytest

from stack.costmap.speed_limits import SpeedLimitParameters, SpeedLimits
from stack.frames.buffer import TransformBuffer
from stack.navigation.world_model import WorldModel
from stack.perception.tracking.parameters import TrackerParameters
from stack.perception.tracking.tracker import Tracker
from stack.types import (
    STANDSTILL,
    Observation,
    Odometry,
    Pose2D,
    PoseEstimate,
    RangeReading,
    Scan,
)

BEAMS, RANGE_MAX = 720, 12.0
RADIUS = 0.25


def seen(pose, people, stamp, field_of_view=2.0 * pi):
    """A scan of people (x, y) in closed form, by a lidar at the base."""
    bearings = -pi + 2.0 * pi / BEAMS * np.arange(BEAMS)
    dx, dy = np.cos(bearings + pose.heading), np.sin(bearings + pose.heading)
    ranges = np.full(BEAMS, inf)
    for x, y in people:
        along = (x - pose.x) * dx + (y - pose.y) * dy
        across = (x - pose.x) * dy - (y - pose.y) * dx
        hit = (np.abs(across) < RADIUS) & (along > 0)
        ranges[hit] = np.minimum(ranges, along - np.sqrt(np.maximum(RADIUS**2 - across**2, 0)))[hit]
    ranges[np.abs(bearings) > 0.5 * field_of_view] = np.nan
    return Scan(stamp, ranges.astype(np.float32), -pi, 2.0 * pi / BEAMS, 0.08, RANGE_MAX)


class RecordingCostmap:
    """Keeps the newest update."""

    def update(self, update):
        self.newest = update


class Robot:
    """A robot that sees people with a world model without a map.

    Attributes:
        costmap: of which the newest update is kept.
    """

    def __init__(self, **tracking):
        self.costmap, self.frames = RecordingCostmap(), TransformBuffer()
        self.model = WorldModel(
            self.costmap, self.costmap, Tracker(TrackerParameters(**tracking)),
            SpeedLimits(SpeedLimitParameters()), lidar="lidar", deceleration=1.0,
            cover=lambda _: None,
        )  # fmt: skip

    def step(self, time, measurements, pose=Pose2D(0.0, 0.0)):
        """Process measurements by sensor name; return the view of the world."""
        self.frames.add(Odometry(time, pose, STANDSTILL))
        self.frames.correct(PoseEstimate(pose, np.zeros((3, 3)), 1.0, corrected_at=time))
        return self.model.update(Observation(time, measurements), self.frames, evades=True)


def test_who_has_stood_for_long_is_still_an_obstacle_when_the_robot_looks_again():
    """They are out of sight for 3 s, while somebody else walks in sight of the robot."""
    robot = Robot()

    def standing(time):
        return 2.0, -1.0 + min(time, 1.0)

    def walking(time):
        return -2.0, -8.0 + 0.5 * time

    evaded = {}
    for n in range(200):
        time = 0.1 * n
        turned_away = 13.0 <= time < 16.0
        pose = Pose2D(0.0, 0.0, pi if turned_away else 0.0)
        view = pi if turned_away else 2.0 * pi
        scan = seen(pose, [standing(time), walking(time)], time, view)
        found = robot.step(time, {"lidar": scan}, pose)
        evaded[n] = [walker.id for walker in found.evaded if walker.position[0] > 0.0]
        if 12.5 <= time < 13.0 or time >= 16.5:
            assert len(found.tracks) == 2
    assert evaded[90]  # stood for 8 s: paths lead past them
    assert not evaded[125]  # stood for more than standing_time, 10 s
    assert [n for n in range(160, 200) if evaded[n]] == []


@pytest.mark.parametrize("sensor", ["rear_lidar", "sonar"])
def test_who_walks_is_left_out_where_they_were_when_a_sensor_measured(sensor):
    """At 1.3 m/s, 0.15 s after the last scan of the tracker's lidar: 20 cm on; padding 12 cm."""
    robot, origin = Robot(), Pose2D(0.0, 0.0)

    def walking(time):
        return 6.0 - 1.3 * time, 0.0

    for n in range(20):
        time = 0.1 * n
        robot.step(time, {"lidar": seen(origin, [walking(time)], time)})
    later = time + 0.15
    scan = seen(origin, [walking(later)], later)
    distance = float(np.nanmin(scan.ranges))
    reading = RangeReading(later, distance, 0.5, 0.1, 5.0)
    robot.step(later, {sensor: scan if sensor == "rear_lidar" else reading})
    assert robot.costmap.newest.readings == ()
    if sensor == "rear_lidar":
        assert not np.isfinite(robot.costmap.newest.scans[sensor].measurement.ranges).any()


def test_a_scan_that_takes_its_time_shows_who_walks_where_its_tracks_are():
    """The stamp of a scan is that of its middle, half a turn of the lidar before the step."""
    robot, origin = Robot(), Pose2D(0.0, 0.0)
    robot.step(0.0, {})
    for n in range(1, 20):
        stamp = 0.1 * n - 0.05
        robot.step(0.1 * n, {"lidar": seen(origin, [(6.0 - 2.5 * stamp, 0.0)], stamp)})
    assert not np.isfinite(robot.costmap.newest.scans["lidar"].measurement.ranges).any()
