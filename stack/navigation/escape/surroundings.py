"""Recent views of the robot's surroundings by all its range sensors, odom frame."""

from __future__ import annotations

from collections import deque
from functools import cached_property

import numpy as np

from stack.navigation.escape.views import BeamView, is_near
from stack.types import FloatArray, ObstaclePoints, Perceived, Pose2D, RangeView

STANDING, STANDING_TURN = 0.01, 0.01
"""Motion in metres and radians below which two views count as taken from the same pose."""

APART, APART_TURN = 0.15, 0.3
"""Metres and radians between the poses of stored views of a sensor."""

KEPT_VIEWS = 12
"""Stored views of each sensor."""

TRAIL_STEP, TRAIL_TURN, KEPT_TRAIL = 0.02, 0.05, 150
"""Metres and radians between poses of the trail, and its length: 3 m on a straight line."""


class _Entry:
    """A measurement; it becomes a view when one is asked for, which most never are."""

    def __init__(self, measured: RangeView) -> None:
        self._measured, self.base = measured, measured.base

    @cached_property
    def view(self) -> BeamView:
        """The measurement as a view."""
        return BeamView.of(self._measured)

    def near(self, pose: Pose2D, distance: float, angle: float) -> bool:
        """Whether it was taken near a pose."""
        return is_near(self.base, pose, distance, angle)


class Surroundings:
    """Stores recent views and poses, so that areas hidden from the newest views remain known.

    The newest view of every sensor counts. Older views count only where no newer one, of any
    sensor, sees.
    """

    def __init__(self) -> None:
        self._older: list[tuple[str, _Entry]] = []
        self._newest: dict[str, _Entry] = {}
        self._seen: dict[str, RangeView] = {}
        self._trail: deque[Pose2D] = deque(maxlen=KEPT_TRAIL)
        self._cached_points: FloatArray | None = None
        self.updates = 0
        """Number of steps so far that brought a new view."""

    def look(self, perceived: Perceived) -> None:
        """Add the newest views and the pose; called once per control step."""
        pose = perceived.motion.pose
        if not self._trail or not is_near(self._trail[-1], pose, TRAIL_STEP, TRAIL_TURN):
            self._trail.append(pose)
        self._add_new(perceived.obstacles)

    def _add_new(self, obstacles: ObstaclePoints) -> None:
        new = {
            name: view
            for name, view in obstacles.views.items()
            if name not in self._seen or view is not self._seen[name]
        }
        for name, view in new.items():
            self._seen[name] = view
            self._add(name, _Entry(view))
        if new:
            self._cached_points = None
            self.updates += 1

    @property
    def views(self) -> list[BeamView]:
        """Stored views, the newest of each sensor last."""
        older = (entry for _, entry in self._older)
        return [entry.view for entry in (*older, *self._newest.values())]

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
        found, newest = np.empty((0, 2)), [entry.view for entry in self._newest.values()]
        for view in (entry.view for _, entry in self._older):
            found = np.concatenate([found[~view.shows(found)], view.points()])
        for view in newest:
            found = found[~view.shows(found)]
        return np.concatenate([found, *(view.points() for view in newest)])

    def _add(self, name: str, entry: _Entry) -> None:
        """Replace the newest view of a sensor; keep it if it was taken elsewhere."""
        before = self._newest.get(name)
        if before is not None and before.near(entry.base, STANDING, STANDING_TURN):
            entry.view = entry.view.filled(before.view)  # invalid beams, of the same pose
        elif before is not None:
            self._keep(name, before)
        self._newest[name] = entry

    def _keep(self, name: str, entry: _Entry) -> None:
        """Store a view unless there is one of the sensor near it; drop the sensor's oldest one."""
        same = [item for item in self._older if item[0] == name]
        if any(kept.near(entry.base, APART, APART_TURN) for _, kept in reversed(same)):
            return
        if len(same) == KEPT_VIEWS:
            self._older = [item for item in self._older if item is not same[0]]
        self._older.append((name, entry))
