"""Newest data of the step loop, from which the robot facade and displays answer."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar

from stack.types import (
    NO_DEPTH,
    STANDSTILL,
    Battery,
    DepthImage,
    DepthPoints,
    Image,
    Imu,
    Measurement,
    ObstaclePoints,
    Odometry,
    Pose2D,
    RangeReading,
    Scan,
    StandingObject,
    TrackedObject,
    Twist,
)

M = TypeVar("M", Scan, RangeReading, Odometry, Imu, Image, DepthImage, Battery)

AT_ORIGIN = Odometry(0.0, Pose2D(0.0, 0.0), STANDSTILL)


@dataclass
class LoopState:
    """Results of the stages of the last step. Only the step loop writes it.

    Attributes:
        time: seconds on the body's clock.
        measurements: newest measurement of every sensor, by name.
        motion: fused odometry.
        obstacles: points of all range sensors.
        depth: what the depth cameras have seen.
        tracks: moving objects around the robot at `time`, map frame.
        standing: objects in the newest scan that are not on the map and have not moved.
        commanded: velocity sent to the body.
    """

    time: float = 0.0
    measurements: dict[str, Measurement] = field(default_factory=dict)
    motion: Odometry = AT_ORIGIN
    obstacles: ObstaclePoints = field(default_factory=ObstaclePoints)
    depth: DepthPoints = NO_DEPTH
    tracks: tuple[TrackedObject, ...] = ()
    standing: tuple[StandingObject, ...] = ()
    commanded: Twist = STANDSTILL

    def newest(self, name: str, kind: type[M]) -> M | None:
        """Return the newest measurement of a sensor; None before the first one of this type."""
        measurement = self.measurements.get(name)
        return measurement if isinstance(measurement, kind) else None

    @property
    def scans(self) -> dict[str, Scan]:
        """Newest scan of every lidar, by name."""
        return {name: scan for name, scan in self.measurements.items() if isinstance(scan, Scan)}

    @property
    def battery(self) -> Battery:
        """State of charge; full before the first measurement."""
        return self.newest("battery", Battery) or Battery(1.0)
