"""Pose of a dock from the end points of a scan: a search around a guess, then a refinement.

The search counts the points on the outline for every pose in a window (correlative scan matching:
E. Olson, "Real-Time Correlative Scan Matching", ICRA 2009). The refinement minimises the distances
of the points from the outline's sides (point-to-line ICP: A. Censi, ICRA 2008).
"""

from __future__ import annotations

from itertools import pairwise
from math import radians

import numpy as np

from stack.types import DockShape, FloatArray, Pose2D, wrap_angle

WINDOW, STEP = 0.3, 0.03
"""Metres around the guess that are searched, and from pose to pose."""

TURN, TURN_STEP = radians(20.0), radians(4.0)
FIELD, CELL = 0.8, 0.01
"""Half a side of the distance field, and of its cells, metres."""

NEAR, MATCHED = 0.06, 0.03
"""Metres from the outline within which a point counts in the search, and belongs to it at last."""

LEAST_POINTS = 3
"""Points on each post and in the slot."""

LEAST_SHARE = 0.75
"""Share of the points at the block's front that must lie on the outline."""

FIT_ROUNDS = 8


class DockFitter:
    """Finds a dock of a shape in scans."""

    def __init__(self, shape: DockShape) -> None:
        self._shape = shape
        self._sides = np.array([(*start, *end) for start, end in pairwise(shape.outline)])
        axis = np.arange(-FIELD, FIELD, CELL) + CELL / 2.0
        x, y = np.meshgrid(axis, axis)
        away = self._distances(np.column_stack([x.ravel(), y.ravel()]))[0].reshape(x.shape)
        self._field = np.maximum(0.0, 1.0 - (away / NEAR) ** 2)

    def fit(self, points: FloatArray, guess: Pose2D) -> Pose2D | None:
        """Return the pose of the dock near a guess; None if there is none.

        Args:
            points: (n, 2) end points of a scan, metres.
            guess: pose of the dock's frame, in the frame of the points.
        """
        reach = WINDOW + self._shape.width
        near = points[np.linalg.norm(points - [guess.x, guess.y], axis=1) < reach]
        if len(near) < 3 * LEAST_POINTS:
            return None
        return self._judged(near, self._refined(near, self._searched(near, guess)))

    def _searched(self, points: FloatArray, guess: Pose2D) -> Pose2D:
        """Return the pose in the window that has the most points on the outline."""
        shifts = np.arange(-WINDOW, WINDOW + STEP / 2.0, STEP)
        dx, dy = (values.ravel() for values in np.meshgrid(shifts, shifts))
        best, found = -1.0, guess
        for turn in np.arange(-TURN, TURN + TURN_STEP / 2.0, TURN_STEP):
            turned = Pose2D(guess.x, guess.y, wrap_angle(guess.heading + float(turn)))
            local = turned.inverse().transform(points)
            columns, rows = (
                ((local[:, axis] - shift[:, None] + FIELD) / CELL).astype(np.int64)
                for axis, shift in ((0, dx), (1, dy))
            )
            size = len(self._field)
            inside = (columns >= 0) & (columns < size) & (rows >= 0) & (rows < size)
            values = self._field[np.clip(rows, 0, size - 1), np.clip(columns, 0, size - 1)]
            scores = (values * inside).sum(axis=1)
            top = int(scores.argmax())
            if scores[top] > best:
                best = float(scores[top])
                found = turned.compose(Pose2D(float(dx[top]), float(dy[top])))
        return found

    def _refined(self, points: FloatArray, pose: Pose2D) -> Pose2D:
        """Return the pose with the least squares of the distances of the points from the sides."""
        for _ in range(FIT_ROUNDS):
            local = pose.inverse().transform(points)
            away, feet = self._distances(local)
            mine = away < NEAR
            if mine.sum() < 3 * LEAST_POINTS:
                return pose
            normals = (local - feet)[mine] / np.maximum(away[mine], 1e-6)[:, None]
            x, y = feet[mine].T
            jacobian = np.column_stack([normals, normals[:, 1] * x - normals[:, 0] * y])
            weights = np.maximum(1e-3, 1.0 - (away[mine] / NEAR) ** 2)
            step = np.linalg.lstsq(
                jacobian * weights[:, None], weights * away[mine], rcond=None
            )[0]  # fmt: skip
            pose = pose.compose(Pose2D(float(step[0]), float(step[1]), float(step[2])))
            if np.abs(step).max() < 1e-5:
                break
        return pose

    def _judged(self, points: FloatArray, pose: Pose2D) -> Pose2D | None:
        """Return the pose, or None if the points do not show a dock there."""
        shape, local = self._shape, pose.inverse().transform(points)
        away, feet = self._distances(local)
        mine = away < MATCHED
        middle = np.abs(local[:, 1]) < shape.slot_width / 2.0
        at_face = mine & (np.abs(feet[:, 0]) < 1e-6)
        parts = (
            at_face & (local[:, 1] > 0.0) & ~middle, at_face & (local[:, 1] < 0.0) & ~middle,
            mine & middle & (feet[:, 0] < -0.5 * shape.slot_depth),
        )  # fmt: skip
        front = (
            (np.abs(local[:, 1]) < shape.width / 2.0)
            & (local[:, 0] < 0.15) & (local[:, 0] > -shape.slot_depth - MATCHED)
        )  # fmt: skip
        if min(int(part.sum()) for part in parts) < LEAST_POINTS:
            return None
        if mine[front].mean() < LEAST_SHARE:
            return None
        return pose

    def _distances(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distances (n,) of points from the outline, and its nearest points (n, 2)."""
        start, edge = self._sides[:, :2], self._sides[:, 2:] - self._sides[:, :2]
        reach = points[:, None] - start
        share = np.clip((reach * edge).sum(axis=2) / (edge**2).sum(axis=1), 0.0, 1.0)
        feet = start + share[..., None] * edge
        away = np.linalg.norm(points[:, None] - feet, axis=2)
        nearest = away.argmin(axis=1)
        rows = np.arange(len(points))
        return away[rows, nearest], feet[rows, nearest]
