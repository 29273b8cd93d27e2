"""What one step of the loop has perceived."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf
from typing import TypeVar

import numpy as np

from stack.types.detections import NO_OBJECTS, SeenObjects
from stack.types.geometry import STANDSTILL, FloatArray, Pose2D, wrap_angle
from stack.types.obstacles import NO_DEPTH, DepthPoints, ObstaclePoints
from stack.types.sensors import (
    Battery,
    Measurement,
    Odometry,
)
from stack.types.world import PoseEstimate, StandingObject, TrackedObject

M = TypeVar("M", bound=Measurement)

AT_ORIGIN = Odometry(0.0, Pose2D(0.0, 0.0), STANDSTILL)

NOTHING_MOVES: FloatArray = np.empty((0, 5))

JUMP_DISTANCE, JUMP_ANGLE = 0.3, 0.2
"""Metres and radians between two poses; what was sensed at one has a wrong place at the other."""


def has_jumped(
    before: PoseEstimate, after: PoseEstimate, distance: float = JUMP_DISTANCE,
    angle: float = JUMP_ANGLE,
) -> bool:  # fmt: skip
    """Whether what was sensed at one estimate has a wrong place on the map at the other.

    The change of map -> odom decides, at the place of the robot. Most steps have none.

    Args:
        before: an estimate.
        after: a later one.
        distance: metres up to which a place is not wrong.
        angle: radians up to which it is not.
    """
    if before.map_from_odom == after.map_from_odom:
        return False
    odometry = after.map_from_odom.inverse().compose(after.pose)
    place = before.map_from_odom.compose(odometry)
    turn = abs(wrap_angle(after.pose.heading - place.heading))
    return place.distance_to(after.pose) > distance or turn > angle


@dataclass(frozen=True, slots=True)
class WorldView:
    """What is known of the surroundings in a step.

    Attributes:
        tracks: moving objects at the time of the step, map frame.
        moving: (k, 5) the same in the base frame, as `stack.safety.monitor.moving_discs`.
        speed_limit: at the robot's pose, m/s; inf without one.
        standing: objects in the newest scan that are not on the map and have not moved: things, or
            people who stand.
        evaded: those of `tracks` that no costmap shows: only evasion keeps the robot clear of them.
    """

    tracks: tuple[TrackedObject, ...] = ()
    moving: FloatArray = field(default_factory=lambda: NOTHING_MOVES)
    speed_limit: float = inf
    standing: tuple[StandingObject, ...] = ()
    evaded: tuple[TrackedObject, ...] = ()


@dataclass(frozen=True, slots=True)
class Perceived:
    """What a step has perceived: made once, and handed to tree, navigator, safety and snapshot.

    Attributes:
        time: seconds on the body's clock.
        estimate: pose in the map frame.
        motion: fused odometry: pose in the odom frame and measured velocity.
        obstacles: points of all range sensors, compensated to `time`.
        depth: what the depth cameras have seen.
        objects: what the object detector has found.
        world: moving and standing objects, speed limit.
        measurements: newest measurement of every sensor, by name.
    """

    time: float
    estimate: PoseEstimate
    motion: Odometry = AT_ORIGIN
    obstacles: ObstaclePoints = field(default_factory=ObstaclePoints)
    depth: DepthPoints = NO_DEPTH
    objects: SeenObjects = NO_OBJECTS
    world: WorldView = field(default_factory=WorldView)
    measurements: Mapping[str, Measurement] = field(default_factory=dict)

    def is_outdated_by(self, estimate: PoseEstimate) -> bool:
        """Whether the estimate has jumped since, so far that places on the map are wrong."""
        return has_jumped(self.estimate, estimate)

    def at(self, estimate: PoseEstimate) -> Perceived:
        """Return the record at a newer estimate, without what a jump to it has made wrong.

        What is relative to the robot stays: points, `moving`; and the speed limit until the next
        step.
        """
        if estimate is self.estimate:
            return self
        if not self.is_outdated_by(estimate):
            return replace(self, estimate=estimate)
        world = replace(self.world, tracks=(), standing=(), evaded=())
        return replace(self, estimate=estimate, objects=NO_OBJECTS, world=world)

    def newest(self, name: str, kind: type[M]) -> M | None:
        """Return the newest measurement of a sensor; None before the first one of this type."""
        measurement = self.measurements.get(name)
        return measurement if isinstance(measurement, kind) else None

    @property
    def battery(self) -> Battery:
        """State of charge; full before the first measurement."""
        return self.newest("battery", Battery) or Battery(1.0)


class CurrentStep:
    """Holds the record of the newest step, for those who answer questions about it.

    The step loop sets it; nobody keeps another.

    Args:
        perceived: before the first step.

    Attributes:
        perceived: of the newest step.
    """

    def __init__(self, perceived: Perceived) -> None:
        self.perceived = perceived

    def see(self, perceived: Perceived) -> None:
        """Answer from a newer record, from now on."""
        self.perceived = perceived
