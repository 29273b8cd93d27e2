"""Data that travels through treepilot. Metres, radians, seconds; x forward, y left, z up.

Frames follow REP 105: map -> odom -> base -> sensors. Every record is frozen; arrays inside are
never written to after they were handed over.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, StrEnum, auto
from math import atan2, cos, hypot, pi, sin
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FREE_COST, INSCRIBED_COST, LETHAL_COST, UNKNOWN_COST = 0, 253, 254, 255
"""Costmap values as in Nav2: 1..252 inflated, 253 the centre would collide, 254 occupied."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Occupancy values as in ROS' OccupancyGrid."""


def wrap_angle(angle: float) -> float:
    """The same angle in (-pi, pi]."""
    wrapped = (angle + pi) % (2.0 * pi) - pi
    return pi if wrapped == -pi else wrapped


@dataclass(frozen=True, slots=True)
class Pose2D:
    """A position and heading in the plane.

    Attributes:
        x: metres along the frame's x axis.
        y: metres along the frame's y axis.
        heading: radians, anticlockwise from the frame's x axis.
    """

    x: float
    y: float
    heading: float = 0.0

    def distance_to(self, other: Pose2D) -> float:
        """Straight-line distance between the two positions, in metres."""
        return hypot(other.x - self.x, other.y - self.y)

    def bearing_to(self, other: Pose2D) -> float:
        """Direction from this position to the other, radians in the frame of both."""
        return atan2(other.y - self.y, other.x - self.x)

    def compose(self, local: Pose2D) -> Pose2D:
        """The pose `local`, given in this pose's frame, in the frame this pose is given in."""
        c, s = cos(self.heading), sin(self.heading)
        return Pose2D(
            self.x + c * local.x - s * local.y,
            self.y + s * local.x + c * local.y,
            wrap_angle(self.heading + local.heading),
        )

    def inverse(self) -> Pose2D:
        """The pose that composes with this one to the identity."""
        c, s = cos(self.heading), sin(self.heading)
        return Pose2D(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.heading))

    def relative_to(self, base: Pose2D) -> Pose2D:
        """This pose seen from `base`: base.compose(result) is this pose."""
        return base.inverse().compose(self)

    def transform(self, points: FloatArray) -> FloatArray:
        """Points (n, 2) given in this pose's frame, in the frame this pose is given in."""
        c, s = cos(self.heading), sin(self.heading)
        turned: FloatArray = points @ np.array([[c, s], [-s, c]])
        turned += (self.x, self.y)
        return turned


@dataclass(frozen=True, slots=True)
class Twist:
    """Velocity in the base frame: metres per second forward and to the left, radians per second."""

    linear: float = 0.0
    angular: float = 0.0
    lateral: float = 0.0


STANDSTILL = Twist()


@dataclass(frozen=True, slots=True)
class Path:
    """Poses to drive through in turn, in the map frame.

    Attributes:
        points: (n, 3) float64: x, y in metres and heading in radians; start first.
        speed_limits: (n,) m/s, the most that may be driven from each point to the next; inf is
            the robot's own. None where there is no limit.
        partial: it ends farther from the goal than a planner tolerates, as near as could be.
    """

    points: FloatArray
    speed_limits: FloatArray | None = None
    partial: bool = False

    @property
    def length(self) -> float:
        """Length along the path, in metres."""
        return float(np.linalg.norm(np.diff(self.points[:, :2], axis=0), axis=1).sum())

    @property
    def goal(self) -> Pose2D:
        """The last pose."""
        x, y, heading = self.points[-1]
        return Pose2D(float(x), float(y), float(heading))


@dataclass(frozen=True, slots=True)
class Footprint:
    """The robot's outline on the floor, in the base frame.

    Attributes:
        points: (n, 2) corners in metres, anticlockwise, n >= 3. A round robot is a 16-gon.
    """

    points: FloatArray

    @staticmethod
    def circle(radius: float) -> Footprint:
        """A regular 16-gon that contains the circle of this radius."""
        angles = np.arange(16) * (2.0 * pi / 16)
        outer = radius / cos(pi / 16)
        return Footprint(outer * np.column_stack([np.cos(angles), np.sin(angles)]))

    @property
    def inscribed_radius(self) -> float:
        """Distance from the base to the nearest edge, in metres."""
        starts, ends = self.points, np.roll(self.points, -1, axis=0)
        edges = ends - starts
        t = -np.einsum("ij,ij->i", starts, edges) / np.einsum("ij,ij->i", edges, edges)
        nearest = starts + np.clip(t, 0.0, 1.0)[:, None] * edges
        return float(np.linalg.norm(nearest, axis=1).min())

    @property
    def circumscribed_radius(self) -> float:
        """Distance from the base to the farthest corner, in metres."""
        return float(np.linalg.norm(self.points, axis=1).max())


@dataclass(frozen=True, slots=True)
class Scan:
    """One turn of a planar lidar.

    Attributes:
        stamp: seconds on the body's clock at the middle of the turn.
        ranges: (n,) float32 metres; +inf no return, NaN invalid or below the minimum.
        angle_min: direction of beam 0 in the sensor frame, radians.
        angle_increment: radians from beam to beam.
        range_min: metres.
        range_max: metres.
        mount: the sensor's pose in the base frame.
    """

    stamp: float
    ranges: NDArray[np.float32]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    mount: Pose2D = Pose2D(0.0, 0.0)

    @property
    def angles(self) -> FloatArray:
        """(n,) beam directions in the sensor frame, radians."""
        return self.angle_min + self.angle_increment * np.arange(self.ranges.size, dtype=np.float64)

    def points(self) -> FloatArray:
        """(m, 2) end points of the beams that returned, in the base frame, metres."""
        hit = np.isfinite(self.ranges)
        ranges, angles = self.ranges[hit].astype(np.float64), self.angles[hit]
        return self.mount.transform(
            np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
        )


@dataclass(frozen=True, slots=True)
class RangeReading:
    """One reading of a sonar-like sensor: the nearest thing somewhere in a cone.

    Attributes:
        stamp: seconds on the body's clock.
        distance: metres; +inf when nothing was heard.
        field_of_view: full opening of the cone, radians.
        range_min: metres; nearer readings are invalid.
        range_max: metres; farther ones are no return.
        mount: the sensor's pose in the base frame.
        source: the sensor's name.
    """

    stamp: float
    distance: float
    field_of_view: float
    range_min: float
    range_max: float
    mount: Pose2D = Pose2D(0.0, 0.0)
    source: str = "sonar"


@dataclass(frozen=True, slots=True)
class TrackedObject:
    """A moving thing that was followed over several scans, map frame.

    Attributes:
        id: number, never used again in a run.
        stamp: seconds on the robot's clock for which the rest holds.
        position: (x, y) of its middle, metres.
        velocity: (x, y), metres per second.
        radius: of the circle that it fits in, metres.
        covariance: (4, 4) of position x, y and velocity x, y.
    """

    id: int
    stamp: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    radius: float
    covariance: FloatArray

    @property
    def speed(self) -> float:
        """Metres per second."""
        return hypot(*self.velocity)

    def position_after(self, seconds: float) -> tuple[float, float]:
        """Where its middle will be if it keeps its velocity, metres."""
        return (
            self.position[0] + seconds * self.velocity[0],
            self.position[1] + seconds * self.velocity[1],
        )

    def at(self, time: float) -> TrackedObject:
        """The same thing at another time, where it keeps its velocity; covariance as it was."""
        return replace(self, stamp=time, position=self.position_after(time - self.stamp))


@dataclass(frozen=True, slots=True)
class Odometry:
    """Dead reckoning: a pose in the odom frame, which drifts but never jumps, and the speed."""

    stamp: float
    pose: Pose2D
    twist: Twist


@dataclass(frozen=True, slots=True)
class Imu:
    """A batch of inertial samples since the last observation, base frame.

    Attributes:
        stamps: (n,) seconds.
        angular_velocity: (n, 3) rad/s.
        linear_acceleration: (n, 3) m/s², gravity included (+9.81 on z at rest).
    """

    stamps: FloatArray
    angular_velocity: FloatArray
    linear_acceleration: FloatArray


@dataclass(frozen=True, slots=True)
class CameraModel:
    """A pinhole camera without distortion and where it sits.

    Attributes:
        width: pixels.
        height: pixels.
        focal_length: pixels, the same for x and y.
        position: (x, y, z) of the optical centre in the base frame, metres.
        pitch: radians, positive looking down.
        yaw: radians, positive to the left.
    """

    width: int
    height: int
    focal_length: float
    position: tuple[float, float, float]
    pitch: float = 0.0
    yaw: float = 0.0

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) intrinsic matrix; the principal point is the image's middle."""
        f = self.focal_length
        return np.array([[f, 0, self.width / 2], [0, f, self.height / 2], [0, 0, 1]], dtype=float)

    def base_from_optical(self) -> FloatArray:
        """(4, 4) transform of optical-frame points (x right, y down, z forward) to the base."""
        cp, sp, cy, sy = cos(self.pitch), sin(self.pitch), cos(self.yaw), sin(self.yaw)
        forward = np.array([cp * cy, cp * sy, -sp])
        right = np.array([sy, -cy, 0.0])
        transform = np.eye(4)
        transform[:3, 0], transform[:3, 1] = right, np.cross(forward, right)
        transform[:3, 2], transform[:3, 3] = forward, self.position
        return transform


@dataclass(frozen=True, slots=True)
class Image:
    """A camera picture: pixels (height, width, 3) uint8 RGB, stamped at mid-exposure."""

    stamp: float
    pixels: NDArray[np.uint8]
    camera: CameraModel


@dataclass(frozen=True, slots=True)
class Battery:
    """Charge in [0, 1], whether it is being charged, and the voltage."""

    charge: float
    charging: bool = False
    voltage: float = 24.0


@dataclass(frozen=True, slots=True)
class Observation:
    """What the sensors said since the last step. A sensor without news is None.

    Attributes:
        time: seconds on the body's clock.
        odometry: wheel odometry.
        battery: state of charge.
        scan: a new lidar scan.
        imu: inertial samples since the last observation.
        image: a new camera picture, only while somebody asks for pictures.
        bumped: a bumper touches something.
        scans: new ones of further lidars, by the sensor's name.
        readings: new ones of sonars.
    """

    time: float
    odometry: Odometry
    battery: Battery
    scan: Scan | None = None
    imu: Imu | None = None
    image: Image | None = None
    bumped: bool = False
    scans: Mapping[str, Scan] = field(default_factory=dict)
    readings: tuple[RangeReading, ...] = ()


@dataclass(frozen=True, slots=True)
class Marker:
    """A square fiducial of known size at a known place, in the map frame.

    Attributes:
        number: its id in the dictionary.
        size: side of the black square, metres.
        position: (x, y, z) of the middle, metres.
        heading: direction in which it faces (its outward normal), radians; it stands upright.
        dictionary: an OpenCV ArUco dictionary, e.g. DICT_4X4_50 or DICT_APRILTAG_36h11.
    """

    number: int
    size: float
    position: tuple[float, float, float]
    heading: float
    dictionary: str = "DICT_4X4_50"


class _Grid(Protocol):
    """What the geometry of a grid needs; shared by OccupancyGrid and CostGrid."""

    @property
    def cells(self) -> NDArray[Any]: ...
    @property
    def resolution(self) -> float: ...
    @property
    def origin(self) -> tuple[float, float]: ...


@dataclass(frozen=True, slots=True)
class OccupancyGrid:
    """A map of free, occupied and unknown cells, in the map frame.

    Attributes:
        cells: (rows, columns) int8: FREE 0, OCCUPIED 100, UNKNOWN -1; row 0 at the smallest y.
        resolution: side of a cell, metres.
        origin: (x, y) of the outer corner of cell (0, 0), metres.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: tuple[float, float] = (0.0, 0.0)

    def cell_at(self: _Grid, x: float, y: float) -> tuple[int, int]:
        """(row, column) of the cell that holds the point; may lie outside the grid."""
        return (
            int((y - self.origin[1]) // self.resolution),
            int((x - self.origin[0]) // self.resolution),
        )

    def centre_of(self: _Grid, row: int, column: int) -> tuple[float, float]:
        """(x, y) in metres of the middle of a cell."""
        return (
            self.origin[0] + (column + 0.5) * self.resolution,
            self.origin[1] + (row + 0.5) * self.resolution,
        )

    def contains(self: _Grid, row: int, column: int) -> bool:
        """Whether the cell lies on the grid."""
        rows, columns = self.cells.shape
        return bool(0 <= row < rows and 0 <= column < columns)


@dataclass(frozen=True, slots=True)
class CostGrid:
    """What each cell costs to drive through, in the map frame.

    Attributes:
        cells: (rows, columns) uint8, Nav2's values; row 0 at the smallest y.
        resolution: side of a cell, metres.
        origin: (x, y) of the outer corner of cell (0, 0), metres.
    """

    cells: NDArray[np.uint8]
    resolution: float
    origin: tuple[float, float] = (0.0, 0.0)

    cell_at = OccupancyGrid.cell_at
    centre_of = OccupancyGrid.centre_of
    contains = OccupancyGrid.contains


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """Where the robot believes it is.

    Attributes:
        pose: map frame.
        covariance: (3, 3) of x, y, heading.
        health: in [0, 1]; how well the scans fit the map here. Below 0.3 something is wrong.
    """

    pose: Pose2D
    covariance: FloatArray
    health: float

    @property
    def position_deviation(self) -> float:
        """Standard deviation of the position along its worst direction, metres."""
        return float(np.sqrt(max(0.0, np.linalg.eigvalsh(self.covariance[:2, :2])[-1])))

    @property
    def heading_deviation(self) -> float:
        """Standard deviation of the heading, radians."""
        return float(np.sqrt(max(0.0, self.covariance[2, 2])))


@dataclass(frozen=True, slots=True)
class PoseCandidate:
    """A pose of the robot that a marker sighting would explain, and how badly it fits.

    Attributes:
        pose: of the base in the map frame, at the image's stamp.
        error: reprojection error, pixels.
    """

    pose: Pose2D
    error: float


@dataclass(frozen=True, slots=True)
class MarkerSighting:
    """A known marker seen in an image; both IPPE solutions, better first."""

    stamp: float
    marker: Marker
    distance: float
    candidates: tuple[PoseCandidate, ...]


class TaskStatus(Enum):
    """How far a task asked of the robot has come."""

    RUNNING = auto()
    SUCCEEDED = auto()
    FAILED = auto()
    CANCELLED = auto()


class FailureCode(StrEnum):
    """Why something failed; what `error` is compared with in mission files."""

    NO_VALID_PATH = "NO_VALID_PATH"
    START_OCCUPIED = "START_OCCUPIED"
    GOAL_OCCUPIED = "GOAL_OCCUPIED"
    START_OUTSIDE_MAP = "START_OUTSIDE_MAP"
    GOAL_OUTSIDE_MAP = "GOAL_OUTSIDE_MAP"
    NO_PROGRESS = "NO_PROGRESS"
    COLLISION_AHEAD = "COLLISION_AHEAD"
    LOST = "LOST"
    CANCELLED = "CANCELLED"
    TIMED_OUT = "TIMED_OUT"
    AMBIGUOUS = "AMBIGUOUS"
    NO_WALL = "NO_WALL"
    NO_IMAGE = "NO_IMAGE"
    CHECK_FAILED = "CHECK_FAILED"
    UNSUPPORTED = "UNSUPPORTED"
    EXCEPTION = "EXCEPTION"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True)
class Failure:
    """Why something failed: a code for machines and a sentence for people."""

    code: str
    sentence: str


class Expression(Protocol):
    """A checked expression of a mission file, ready to be evaluated on the robot's own values."""

    source: str

    def __call__(self) -> Any:
        """The value now; a bool for conditions."""
        ...

    def explain(self) -> str:
        """The expression with the values its names have now, e.g. `battery.charge (0.18) > 0.3`."""
        ...


@dataclass(frozen=True, slots=True)
class Assignments:
    """What `set` writes: blackboard keys, each with the expression for its new value."""

    writes: tuple[tuple[str, Expression, Callable[[Any], None]], ...] = field(default=())
