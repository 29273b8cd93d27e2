"""What the lidar saw of the robot's surroundings lately, in the odom frame."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.kinematics import moved
from stack.navigation.tasks import NavigationState
from stack.types import FloatArray, Pose2D, Scan, wrap_angle

STANDING, STANDING_TURN = 0.01, 0.01
"""Metres and radians between two scans that count as taken from the same place."""

APART, APART_TURN = 0.15, 0.3
"""Metres and radians between the places from which views are kept."""

KEPT_VIEWS = 12
TRAIL_STEP, TRAIL_TURN, KEPT_TRAIL = 0.02, 0.05, 150
"""Metres and radians between poses of the trail, and how many are kept: three metres straight."""

OCCLUDED = 0.1
"""Metres behind what a beam hit from where on nothing is known any more."""


@dataclass(frozen=True, slots=True)
class View:
    """A scan and where it was taken.

    Attributes:
        base: pose of the robot, odom frame.
        scan: with what was invalid filled from the scans before it, if the robot stood.
    """

    base: Pose2D
    scan: Scan

    @property
    def sensor(self) -> Pose2D:
        """Pose of the lidar, odom frame."""
        return self.base.compose(self.scan.mount)

    def near(self, pose: Pose2D, distance: float, angle: float) -> bool:
        """Whether it was taken about there."""
        turn = abs(wrap_angle(pose.heading - self.base.heading))
        return self.base.distance_to(pose) <= distance and turn <= angle

    def points(self) -> FloatArray:
        """(m, 2) end points of the beams that returned, odom frame, metres."""
        return self.base.transform(self.scan.points())

    def shows(self, points: FloatArray) -> NDArray[np.bool_]:
        """(m,) bool: whether the place of each point (m, 2) can be judged by this view."""
        sensor, scan = self.sensor, self.scan
        away = points - (sensor.x, sensor.y)
        turn = np.arctan2(away[:, 1], away[:, 0]) - sensor.heading - scan.angle_min
        beam = np.rint((turn % (2.0 * np.pi)) / scan.angle_increment).astype(np.int64)
        round_about = round(2.0 * np.pi / scan.angle_increment)
        beam %= max(round_about, scan.ranges.size)
        inside = beam < scan.ranges.size
        reach = np.where(inside, scan.ranges[np.minimum(beam, scan.ranges.size - 1)], np.nan)
        shown: NDArray[np.bool_] = np.hypot(away[:, 0], away[:, 1]) <= reach + OCCLUDED
        return shown


class Surroundings:
    """Remembers views and the way driven, so that what is not seen now is not all unknown.

    The newest scan has the last word wherever it looks; older ones count only for directions in
    which it shows nothing, and behind what hides them.
    """

    def __init__(self) -> None:
        self._views: deque[View] = deque(maxlen=KEPT_VIEWS)
        self._trail: deque[Pose2D] = deque(maxlen=KEPT_TRAIL)
        self._newest: View | None = None
        self._seen: Scan | None = None
        self._cloud: FloatArray | None = None

    def look(self, state: NavigationState) -> None:
        """Take in the newest scan and the way since; called once a control step."""
        pose = state.odometry.pose
        if not self._trail or not _close(self._trail[-1], pose, TRAIL_STEP, TRAIL_TURN):
            self._trail.append(pose)
        scan = state.scan
        if scan is None or scan is self._seen:
            return
        self._seen = scan
        since = moved(state.odometry.twist, max(0.0, state.time - scan.stamp))
        self._take(View(pose.compose(since.inverse()), scan))

    @property
    def newest(self) -> View | None:
        """The view from here; None before the first scan."""
        return self._newest

    @property
    def views(self) -> list[View]:
        """What counts, newest last."""
        return [*self._views, *([self._newest] if self._newest else [])]

    @property
    def trail(self) -> FloatArray:
        """(t, 3) poses that the robot stood at, odom frame, newest last."""
        return np.array([(pose.x, pose.y, pose.heading) for pose in self._trail]).reshape(-1, 3)

    def points(self, centre: Pose2D, reach: float) -> FloatArray:
        """(m, 2) what stands around, odom frame, metres.

        Args:
            centre: of what is of interest.
            reach: metres round it.
        """
        if self._cloud is None:
            self._cloud = self._gathered()
        away = np.hypot(self._cloud[:, 0] - centre.x, self._cloud[:, 1] - centre.y)
        near: FloatArray = np.ascontiguousarray(self._cloud[away <= reach])
        return near

    def _gathered(self) -> FloatArray:
        """(m, 2) points of all views that no newer view has seen through, or anew."""
        views, found = self.views, [np.empty((0, 2))]
        for number, view in enumerate(views):
            points = view.points()
            for newer in views[number + 1 :]:
                points = points[~newer.shows(points)]
            found.append(points)
        return np.concatenate(found)

    def _take(self, view: View) -> None:
        before = self._newest
        if before is not None and before.near(view.base, STANDING, STANDING_TURN):
            view = replace(view, scan=_filled(view.scan, before.scan))
        elif before is not None and not any(
            kept.near(before.base, APART, APART_TURN) for kept in self._views
        ):
            self._views.append(before)
        self._newest, self._cloud = view, None


def _filled(scan: Scan, older: Scan) -> Scan:
    """A scan whose invalid beams are those of an older one from the same place."""
    if scan.ranges.shape != older.ranges.shape:
        return scan
    return replace(scan, ranges=np.where(np.isnan(scan.ranges), older.ranges, scan.ranges))


def _close(one: Pose2D, other: Pose2D, distance: float, angle: float) -> bool:
    turn = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) <= distance and turn <= angle
