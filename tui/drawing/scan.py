"""Scans on the map, from where they were taken."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque

from stack.telemetry.beams import LONG, MATCHED, SHORT, beam_classes
from stack.telemetry.records import Snapshot
from stack.types import OccupancyGrid, Pose2D
from tui.drawing import palette
from tui.drawing.canvas import Canvas

KEPT = 1200
"""Snapshots of which the odometry is kept: at least a minute."""


class PastOdometry:
    """Odometry of the last snapshots: where the robot was when an old scan was taken."""

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=KEPT)
        self._poses: deque[Pose2D] = deque(maxlen=KEPT)

    def add(self, snapshot: Snapshot) -> None:
        """Take the odometry of a snapshot."""
        self._times.append(snapshot.time)
        self._poses.append(snapshot.odometry)

    def restart(self) -> None:
        """Forget all of it."""
        self._times.clear()
        self._poses.clear()

    def pose_at(self, time: float, snapshot: Snapshot) -> Pose2D:
        """Return the pose at a time in the map frame, by the wheels from that of a snapshot."""
        number = bisect_right(self._times, time)
        if not self._poses:
            return snapshot.pose
        then = self._poses[min(max(number - 1, 0), len(self._poses) - 1)]
        if 0 < number < len(self._poses):
            share = (time - self._times[number - 1]) / (
                self._times[number] - self._times[number - 1]
            )
            step = self._poses[number].relative_to(then)
            then = then.compose(Pose2D(share * step.x, share * step.y, share * step.heading))
        return snapshot.pose.compose(then.relative_to(snapshot.odometry))


def draw_scan(
    canvas: Canvas, snapshot: Snapshot, past: PastOdometry, grid: OccupancyGrid | None
) -> None:
    """Draw the hits of the newest scan, if there is one, from the pose at which it was taken.

    Those that the map does not explain have other colours; a scan too old to drive by is grey.
    """
    scan = snapshot.scan
    if scan is None:
        return
    pose = past.pose_at(scan.stamp, snapshot)
    if snapshot.old_scan:
        canvas.draw_points(pose.transform(scan.points()), palette.DIM)
        return
    if grid is None:
        canvas.draw_hits(pose.transform(scan.points()), palette.SCAN, palette.WALL_SEEN)
        return
    hits, classes = beam_classes(scan, pose, grid)
    canvas.draw_hits(hits[classes == MATCHED], palette.SCAN, palette.WALL_SEEN)
    canvas.draw_points(hits[classes == SHORT], palette.BEAM_SHORT)
    canvas.draw_points(hits[classes == LONG], palette.BEAM_LONG)
