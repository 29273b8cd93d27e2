"""World model: costmaps, tracks of moving objects and speed limits, from the measurements."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from stack.costmap.costmap import Costmap
from stack.frames.buffer import TransformBuffer
from stack.perception.tracker import Tracker
from stack.types import Observation, Pose2D, RangeReading, Scan, TrackedObject

ROLLING_PERIOD = 0.5
"""Seconds between two updates of the costmaps of a robot without new measurements."""

Group = tuple[dict[str, Scan], tuple[RangeReading, ...]]
"""Scans by lidar, and range readings, with the same stamp."""


@dataclass(frozen=True, slots=True)
class WorldView:
    """What is known of the surroundings in a step.

    Attributes:
        tracks: moving objects at the time of the step, map frame.
        speed_limit: at the robot's pose, m/s; inf without one.
    """

    tracks: tuple[TrackedObject, ...]
    speed_limit: float


class WorldModel:
    """Updates costmaps and tracker with each measurement, at the pose of its stamp.

    Args:
        local_costmap: around the robot.
        global_costmap: of the whole map.
        tracker: of moving objects; None if no component needs tracks.
        lidar: whose scans the tracker uses.
        deceleration: of the robot, m/s²; a speed limit ahead is obeyed in time.
        cover: without a map, grows the global costmap to contain some poses.
    """

    def __init__(  # noqa: PLR0913 - parts of the model, by keyword
        self, local_costmap: Costmap, global_costmap: Costmap, tracker: Tracker | None, *,
        lidar: str, deceleration: float, cover: Callable[[Iterable[Pose2D]], None],
    ) -> None:  # fmt: skip
        self.local_costmap, self.global_costmap = local_costmap, global_costmap
        self._tracker, self._lidar, self._deceleration = tracker, lidar, deceleration
        self.cover = cover
        self._tracks: tuple[TrackedObject, ...] = ()
        self._rolled = 0.0

    def update(self, observation: Observation, frames: TransformBuffer) -> WorldView:
        """Process the new measurements of a step.

        Args:
            observation: with deskewed scans.
            frames: with the odometry and the estimate of this step.
        """
        now, at_rest = observation.time, not self._measured(observation)
        pose = frames.pose_at("map", now)
        self.cover([pose])
        for stamp, (scans, readings) in self._by_stamp(observation):
            self._process(frames.pose_at("map", stamp), scans, readings, now)
        if at_rest and now - self._rolled >= ROLLING_PERIOD:
            self._process(pose, {}, (), now)
        tracks = tuple(track.at(now) for track in self._tracks)
        return WorldView(tracks, self.global_costmap.speed_limit(pose, self._deceleration))

    def _measured(self, observation: Observation) -> bool:
        return bool(observation.of(Scan) or observation.of(RangeReading))

    def _by_stamp(self, observation: Observation) -> list[tuple[float, Group]]:
        """Return the scans and readings with the same stamp together, in order of time."""
        groups: dict[float, Group] = {}
        for name, scan in observation.of(Scan).items():
            groups.setdefault(scan.stamp, ({}, ()))[0][name] = scan
        for reading in observation.of(RangeReading).values():
            scans, readings = groups.get(reading.stamp, ({}, ()))
            groups[reading.stamp] = (scans, (*readings, reading))
        return sorted(groups.items())

    def _process(
        self, pose: Pose2D, scans: dict[str, Scan], readings: tuple[RangeReading, ...], now: float
    ) -> None:
        self._rolled = now
        main, tracks = scans.pop(self._lidar, None), None
        if self._tracker is not None and main is not None:
            tracks = self._tracks = self._tracker.update(pose, main, now)
        for costmap in (self.local_costmap, self.global_costmap):
            for name, scan in scans.items():
                costmap.update_from(name, pose, scan, now)
            if main is not None or readings or not scans:
                costmap.update(pose, main, now, readings=readings, tracks=tracks)

    def forget_tracks(self) -> None:
        """Remove all tracks, for example after a jump of the pose."""
        self._tracks = ()
        if self._tracker is not None:
            self._tracker.clear()
