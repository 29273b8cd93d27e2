"""World model: costmaps, tracks of moving objects and speed limits, from the measurements."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from stack.costmap.costmap import Costmap
from stack.costmap.layer import LayerUpdate, Posed
from stack.costmap.speed_limits import SpeedLimits
from stack.frames.buffer import TransformBuffer
from stack.perception.tracking.people_mask import is_echo_of, without_objects
from stack.perception.tracking.tracker import MOVING_SPEED, Tracker
from stack.safety.monitor import moving_discs
from stack.types import (
    NO_DEPTH,
    NO_OBJECTS,
    PERSON,
    STANDSTILL,
    DepthPoints,
    FloatArray,
    Observation,
    OccupancyGrid,
    Pose2D,
    RangeReading,
    Scan,
    SeenObjects,
    StandingObject,
    TrackedObject,
    Twist,
    WorldView,
)

STANDING_TIME = 10.0
"""Paths lead past people who have stood for less than this; then they are obstacles, s."""

DEPTH_PERIOD = 0.1
"""Seconds for which obstacles of depth cameras wait for the costmaps' update by the next scan: two
updates cost twice as much. Safety and controllers have them at once."""

IDLE_PERIOD = 0.5
"""Seconds without measurements after which the costmaps expire marks and follow the robot."""


class WorldStage(ABC):
    """Keeps what is known of the surroundings."""

    @property
    def costmaps(self) -> Mapping[str, Costmap]:
        """The costmaps by name: local_costmap, global_costmap; empty without any."""
        return {}

    @abstractmethod
    def update(  # noqa: PLR0913 - what a step knows
        self, observation: Observation, frames: TransformBuffer, depth: DepthPoints = NO_DEPTH,
        objects: SeenObjects = NO_OBJECTS, twist: Twist = STANDSTILL, *, evades: bool,
    ) -> WorldView:  # fmt: skip
        """Process the new measurements of a step.

        Args:
            observation: with deskewed, smoothed scans.
            frames: with the odometry and the estimate of this step.
            depth: what the depth cameras have seen.
            objects: what the object detector has found.
            twist: measured velocity, base frame.
            evades: whether only evasion keeps the robot clear of who walks: then neither the local
                costmap nor the controller sees them.
        """

    def show(self, drawn: OccupancyGrid) -> None:  # noqa: B027 - without costmaps
        """Show the map that the estimator draws in the costmaps."""

    def forget(self) -> None:  # noqa: B027 - if nothing is kept
        """Remove what was sensed, after a jump of the pose."""


class WorldModel(WorldStage):
    """Updates costmaps and tracker with each measurement, at the pose of its stamp.

    Args:
        local_costmap: around the robot.
        global_costmap: of the whole map.
        tracker: of moving objects.
        speed_limits: of the zones on the map.
        lidar: whose scans the tracker uses.
        deceleration: of the robot, m/s²; a speed limit ahead is obeyed in time.
        cover: without a map, grows the global costmap to contain some poses.
        draw: shows the map that the estimator draws in the costmaps.
    """

    def __init__(  # noqa: PLR0913 - parts of the model, by keyword
        self, local_costmap: Costmap, global_costmap: Costmap, tracker: Tracker,
        speed_limits: SpeedLimits, *, lidar: str, deceleration: float,
        cover: Callable[[Iterable[Pose2D]], None],
        draw: Callable[[OccupancyGrid], None] = lambda _: None,
    ) -> None:  # fmt: skip
        self.local_costmap, self.global_costmap = local_costmap, global_costmap
        self.tracker, self._lidar, self._deceleration = tracker, lidar, deceleration
        self._speed_limits = speed_limits
        self.cover, self.draw = cover, draw
        self._tracks: tuple[TrackedObject, ...] = ()
        self._standing: tuple[StandingObject, ...] = ()
        self._walkers: tuple[TrackedObject, ...] = ()
        self._walked_at: dict[int, float] = {}
        self._scanned_at = 0.0  # stamp of the scan that showed the tracks
        self._updated_at = 0.0
        self._depth: FloatArray | None = None  # odom frame, not in the costmaps yet

    def update(  # noqa: PLR0913 - what a step knows
        self, observation: Observation, frames: TransformBuffer, depth: DepthPoints = NO_DEPTH,
        objects: SeenObjects = NO_OBJECTS, twist: Twist = STANDSTILL, *, evades: bool,
    ) -> WorldView:  # fmt: skip
        """Process the new measurements of a step, as `WorldStage`."""
        now = observation.time
        pose = frames.pose_at("map", now)
        self.cover([pose])
        scans = {
            name: Posed(scan, frames.pose_at("map", scan.stamp))
            for name, scan in observation.of(Scan).items()
        }
        readings = tuple(
            Posed(reading, frames.pose_at("map", reading.stamp))
            for reading in observation.of(RangeReading).values()
        )
        if depth.changed:
            self._depth = depth.points
        is_new = scans or readings or objects.detections is not None
        wait = IDLE_PERIOD if self._depth is None else DEPTH_PERIOD
        if is_new or now - self._updated_at >= wait:
            self._updated_at = now
            seen = None if self._depth is None else frames.map_from_odom(now).transform(self._depth)
            self._depth = None
            tracks = self._track(scans, now, objects.people)
            update = LayerUpdate(pose, now, scans, readings, tracks, seen, objects.detections)
            without = self._without_walkers(update)
            self.local_costmap.update(without if evades else update)
            self.global_costmap.update(without)
        tracks = tuple(track.at(now) for track in self._tracks)
        speed_limit = self._speed_limits.at_pose(pose, self._deceleration, twist)
        evaded = tuple(walker.at(now) for walker in self._walkers) if evades else ()
        return WorldView(tracks, moving_discs(tracks, pose), speed_limit, self._standing, evaded)

    @property
    def costmaps(self) -> Mapping[str, Costmap]:
        """The local and the global costmap."""
        return {"global_costmap": self.global_costmap, "local_costmap": self.local_costmap}

    def show(self, drawn: OccupancyGrid) -> None:
        """Show the map that the estimator draws in the costmaps."""
        self.draw(drawn)

    def _without_walkers(self, update: LayerUpdate) -> LayerUpdate:
        """Return the measurements without the returns of walking people.

        Who has stood for STANDING_TIME is an obstacle like others until they walk on.
        """
        if not self._tracks:
            self._walkers = ()
            return update
        now = update.time
        for track in self._tracks:
            if track.speed >= MOVING_SPEED or track.id not in self._walked_at:
                self._walked_at[track.id] = now
        known = self.tracker.known_ids
        self._walked_at = {k: time for k, time in self._walked_at.items() if k in known}
        oldest = now - STANDING_TIME
        self._walkers = tuple(t for t in self._tracks if self._walked_at[t.id] >= oldest)
        scans = {
            name: Posed(
                without_objects(
                    posed.measurement, posed.pose, self._walkers_at(posed.measurement.stamp)
                ),
                posed.pose,
            )
            for name, posed in update.scans.items()
        }
        readings = tuple(
            it for it in update.readings
            if not is_echo_of(it.measurement, it.pose, self._walkers_at(it.measurement.stamp))
        )  # fmt: skip
        return replace(update, scans=scans, readings=readings)

    def _walkers_at(self, stamp: float) -> list[TrackedObject]:
        """Return who walks, where a measurement with a stamp shows them.

        Their positions are those in the tracker's newest scan, which was complete later than its
        stamp.
        """
        later = stamp - self._scanned_at
        return [walker.at(walker.stamp + later) for walker in self._walkers]

    def _track(
        self, scans: Mapping[str, Posed[Scan]], now: float, people: frozenset[int]
    ) -> tuple[TrackedObject, ...] | None:
        """Return all tracks after a scan of the tracker's lidar; None without one.

        Args:
            scans: new ones.
            now: robot's clock, seconds.
            people: ids of the tracks that are people.
        """
        posed = scans.get(self._lidar)
        if posed is None:
            return None
        self._scanned_at = posed.measurement.stamp
        self._tracks = tuple(
            replace(track, label=PERSON) if track.id in people else track
            for track in self.tracker.update(posed.pose, posed.measurement, now)
        )
        self._standing = self.tracker.standing
        return self._tracks

    def forget(self) -> None:
        """Remove what was sensed, after a jump of the pose: tracks, and marks in the costmaps."""
        self._tracks = self._walkers = ()
        self._standing = ()
        self.tracker.clear()
        self.local_costmap.clear()
        self.global_costmap.clear()
