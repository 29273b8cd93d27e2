"""World model: who walks is left out of the costmaps, and who has stood for long is not."""

from math import inf, pi

import numpy as np

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
            SpeedLimits(SpeedLimitParameters()), lidar="lidar", deceleration=1.0, evades=True,
            cover=lambda _: None,
        )  # fmt: skip

    def step(self, time, measurements, pose=Pose2D(0.0, 0.0)):
        """Process measurements by sensor name; return the view of the world."""
        self.frames.add(Odometry(time, pose, STANDSTILL))
        self.frames.correct(PoseEstimate(pose, np.zeros((3, 3)), 1.0, corrected_at=time))
        return self.model.update(Observation(time, measurements), self.frames)


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
