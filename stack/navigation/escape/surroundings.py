"""Recent lidar views of the robot's surroundings, odom frame."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.kinematics import moved
from stack.navigation.tasks import NavigationState
from stack.types import FloatArray, Pose2D, Scan, wrap_angle

STANDING, STANDING_TURN = 0.01, 0.01
"""Motion in metres and radians below which two scans count as taken from the same pose."""

APART, APART_TURN = 0.15, 0.3
"""Metres and radians between the poses of stored views."""

KEPT_VIEWS = 12
TRAIL_STEP, TRAIL_TURN, KEPT_TRAIL = 0.02, 0.05, 150
"""Metres and radians between poses of the trail, and its length: 3 m on a straight line."""

OCCLUDED = 0.1
"""Metres behind the end of a beam beyond which the space is hidden."""


@dataclass(frozen=True, slots=True)
class View:
    """A scan and the pose at which it was taken.

    Attributes:
        base: pose of the robot, odom frame.
        scan: if the robot stood, invalid beams are filled from earlier scans.
    """

    base: Pose2D
    scan: Scan

    @property
    def sensor(self) -> Pose2D:
        """Pose of the lidar, odom frame."""
        return self.base.compose(self.scan.mount)

    def near(self, pose: Pose2D, distance: float, angle: float) -> bool:
        """Whether it was taken near a pose."""
        turn = abs(wrap_angle(pose.heading - self.base.heading))
        return self.base.distance_to(pose) <= distance and turn <= angle

    def points(self) -> FloatArray:
        """(m, 2) end points of the beams that returned, odom frame, metres."""
        return self.base.transform(self.scan.points())

    def shows(self, points: FloatArray) -> NDArray[np.bool_]:
        """(m,) whether this view sees the positions of points (m, 2), odom frame."""
        sensor, scan = self.sensor, self.scan
        away = points - (sensor.x, sensor.y)
        turn = np.arctan2(away[:, 1], away[:, 0]) - sensor.heading - scan.angle_min
        beam = np.rint((turn % (2.0 * np.pi)) / scan.angle_increment).astype(np.int64)
        full_turn = round(2.0 * np.pi / scan.angle_increment)
        beam %= max(full_turn, scan.ranges.size)
        inside = beam < scan.ranges.size
        reach = np.where(inside, scan.ranges[np.minimum(beam, scan.ranges.size - 1)], np.nan)
        shown: NDArray[np.bool_] = np.hypot(away[:, 0], away[:, 1]) <= reach + OCCLUDED
        return shown


class Surroundings:
    """Stores recent views and poses, so that areas hidden from the newest scan remain known.

    The newest scan replaces older ones wherever it sees. Older scans are used only where newer ones
    have no valid beam or are occluded.
    """

    def __init__(self) -> None:
        self._views: deque[View] = deque(maxlen=KEPT_VIEWS)
        self._trail: deque[Pose2D] = deque(maxlen=KEPT_TRAIL)
        self._newest: View | None = None
        self._seen: Scan | None = None
        self._cached_points: FloatArray | None = None

    def look(self, state: NavigationState) -> None:
        """Add the newest scan and pose; called once per control step."""
        pose = state.odometry.pose
        if not self._trail or not _close(self._trail[-1], pose, TRAIL_STEP, TRAIL_TURN):
            self._trail.append(pose)
        scan = state.scan
        if scan is None or scan is self._seen:
            return
        self._seen = scan
        since = moved(state.odometry.twist, max(0.0, state.time - scan.stamp))
        self._add(View(pose.compose(since.inverse()), scan))

    @property
    def newest(self) -> View | None:
        """The newest view; None before the first scan."""
        return self._newest

    @property
    def views(self) -> list[View]:
        """Stored views, newest last."""
        return [*self._views, *([self._newest] if self._newest else [])]

    @property
    def trail(self) -> FloatArray:
        """(t, 3) past poses of the robot, odom frame, newest last."""
        return np.array([(pose.x, pose.y, pose.heading) for pose in self._trail]).reshape(-1, 3)

    def points(self, centre: Pose2D, reach: float) -> FloatArray:
        """Return the (m, 2) obstacle points around a pose, odom frame, metres.

        Args:
            centre: of the area.
            reach: radius of the area, metres.
        """
        if self._cached_points is None:
            self._cached_points = self._gathered()
        away = np.hypot(self._cached_points[:, 0] - centre.x, self._cached_points[:, 1] - centre.y)
        near: FloatArray = np.ascontiguousarray(self._cached_points[away <= reach])
        return near

    def _gathered(self) -> FloatArray:
        """(m, 2) points of all views, without those at positions that a newer view sees."""
        views, found = self.views, [np.empty((0, 2))]
        for number, view in enumerate(views):
            points = view.points()
            for newer in views[number + 1 :]:
                points = points[~newer.shows(points)]
            found.append(points)
        return np.concatenate(found)

    def _add(self, view: View) -> None:
        before = self._newest
        if before is not None and before.near(view.base, STANDING, STANDING_TURN):
            view = replace(view, scan=_filled(view.scan, before.scan))
        elif before is not None and not any(
            kept.near(before.base, APART, APART_TURN) for kept in self._views
        ):
            self._views.append(before)
        self._newest, self._cached_points = view, None


def _filled(scan: Scan, older: Scan) -> Scan:
    """Return a scan with its invalid beams filled from an older scan of the same pose."""
    if scan.ranges.shape != older.ranges.shape:
        return scan
    return replace(scan, ranges=np.where(np.isnan(scan.ranges), older.ranges, scan.ranges))


def _close(one: Pose2D, other: Pose2D, distance: float, angle: float) -> bool:
    turn = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) <= distance and turn <= angle
