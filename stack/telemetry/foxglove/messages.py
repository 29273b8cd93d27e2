"""Foxglove's messages: poses, frames, scans, grids, points, pictures and log lines."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, sin

import numpy as np
from foxglove.messages import (
    CameraCalibration,
    CompressedImage,
    FrameTransform,
    FrameTransforms,
    Grid,
    LaserScan,
    Log,
    LogLevel,
    PackedElementField,
    PackedElementFieldNumericType,
    PointCloud,
    Pose,
    PoseInFrame,
    PosesInFrame,
    Quaternion,
    RawImage,
    Timestamp,
    Vector2,
    Vector3,
)

from stack.telemetry.foxglove.urdf_links import BASE, MAP, LinkFrame, Rotation, Vector
from stack.telemetry.grid_colours import coloured, cost_table, map_table
from stack.telemetry.records import Event
from stack.telemetry.snapshots.picture_codes import jpeg
from stack.types import (
    CameraModel,
    CostGrid,
    DepthImage,
    FloatArray,
    Image,
    OccupancyGrid,
    Pose2D,
    Scan,
)

NANOSECONDS = 1_000_000_000

HEIGHTS = {"map": -0.02, "global_costmap": -0.01, "local_costmap": -0.005}
"""Drawing height of each grid, metres: below everything else, in this order."""

OPTICAL = "optical"
"""End of the name of a camera's frame: x right, y down, z forward."""

_Type = PackedElementFieldNumericType

_COLOURS = [
    PackedElementField(name=name, offset=offset, type=_Type.Uint8)
    for offset, name in enumerate(("red", "green", "blue", "alpha"))
]
_COORDINATES = [
    PackedElementField(name=name, offset=4 * index, type=_Type.Float32)
    for index, name in enumerate(("x", "y", "z"))
]

_LEVELS = {"info": LogLevel.Info, "warning": LogLevel.Warning, "error": LogLevel.Error}


def nanoseconds(time: float) -> int:
    """A robot time, seconds, as a time of a message: the epoch is the start of the clock."""
    return max(0, round(time * NANOSECONDS))


def stamp_of(time: float) -> Timestamp:
    """A robot time, seconds, as a stamp in a message."""
    seconds, rest = divmod(nanoseconds(time), NANOSECONDS)
    return Timestamp(sec=seconds, nsec=rest)


def pose_of(pose: Pose2D, height: float = 0.0) -> Pose:
    """A pose on the floor, or above it."""
    return Pose(position=Vector3(x=pose.x, y=pose.y, z=height), orientation=_turn(pose.heading))


def pose_at(position: Vector, rotation: Rotation) -> Pose:
    """A pose in space."""
    return Pose(position=vector(position), orientation=_quaternion(rotation))


def vector(values: Vector) -> Vector3:
    """A point, or the size of a shape."""
    x, y, z = values
    return Vector3(x=x, y=y, z=z)


def pose_in(frame: str, pose: Pose2D, time: float) -> PoseInFrame:
    """A pose of the base."""
    return PoseInFrame(timestamp=stamp_of(time), frame_id=frame, pose=pose_of(pose))


def poses(points: FloatArray | None, time: float) -> PosesInFrame:
    """Poses (n, 3) of a path or of particles in the map frame; None is none."""
    return PosesInFrame(
        timestamp=stamp_of(time),
        frame_id=MAP,
        poses=[pose_of(Pose2D(*point)) for point in (() if points is None else points.tolist())],
    )


def moving_frames(time: float, frames: Iterable[tuple[str, str, Pose2D]]) -> FrameTransforms:
    """Frames on the floor: of each its parent, its name and its pose in the parent."""
    return FrameTransforms(
        transforms=[
            FrameTransform(
                timestamp=stamp_of(time),
                parent_frame_id=parent,
                child_frame_id=name,
                translation=Vector3(x=pose.x, y=pose.y, z=0.0),
                rotation=_turn(pose.heading),
            )
            for parent, name, pose in frames
        ]
    )


def fixed_frames(time: float, frames: Iterable[LinkFrame]) -> FrameTransforms:
    """Frames of the robot's parts."""
    return FrameTransforms(transforms=[_fixed(stamp_of(time), frame) for frame in frames])


def camera_frame(name: str, camera: CameraModel) -> LinkFrame:
    """The optical frame of a camera."""
    transform = camera.base_from_optical()
    x, y, z, w = _rotation(transform[:3, :3])
    return LinkFrame(BASE, f"{name}_{OPTICAL}", camera.position, (x, y, z, w))


def scan_message(scan: Scan) -> LaserScan:
    """A scan in the base frame; its beams are evenly spaced from the first to the last one."""
    first, last = _span(scan)
    return LaserScan(
        timestamp=stamp_of(scan.stamp),
        frame_id=BASE,
        pose=pose_of(scan.mount),
        start_angle=first,
        end_angle=last,
        ranges=scan.ranges.tolist(),
    )


def grid_message(name: str, grid: OccupancyGrid | CostGrid, time: float) -> Grid:
    """A map or costmap: a colour and the value of each cell; row 0 at the smallest y."""
    is_map = isinstance(grid, OccupancyGrid)
    table = map_table() if is_map else cost_table(name)
    rows, columns = grid.cells.shape
    cells = np.empty((rows, columns, 5), np.uint8)
    cells[..., :4] = coloured(grid.cells.view(np.uint8), table)[::-1]  # it turns the rows round
    cells[..., 4] = grid.cells.view(np.uint8)
    value = PackedElementField(name="value", offset=4, type=_Type.Int8 if is_map else _Type.Uint8)
    return Grid(
        timestamp=stamp_of(time),
        frame_id=MAP,
        pose=pose_of(Pose2D(*grid.origin), HEIGHTS.get(name, 0.0)),
        column_count=columns,
        cell_size=Vector2(x=grid.resolution, y=grid.resolution),
        row_stride=5 * columns,
        cell_stride=5,
        fields=[*_COLOURS, value],
        data=cells.tobytes(),
    )


def cloud(points: FloatArray, time: float) -> PointCloud:
    """Points (n, 3) in the map frame, metres."""
    packed = np.asarray(points, np.float32)
    return PointCloud(
        timestamp=stamp_of(time),
        frame_id=MAP,
        pose=pose_of(Pose2D(0.0, 0.0)),
        point_stride=12,
        fields=_COORDINATES,
        data=packed.tobytes(),
    )


def picture(name: str, image: Image) -> CompressedImage:
    """A picture as JPEG."""
    return CompressedImage(
        timestamp=stamp_of(image.stamp),
        frame_id=f"{name}_{OPTICAL}",
        format="jpeg",
        data=jpeg(image.pixels),
    )


def depth_picture(name: str, image: DepthImage) -> RawImage:
    """Distances along the optical axis as float32, metres."""
    rows, columns = image.depth.shape
    return RawImage(
        timestamp=stamp_of(image.stamp),
        frame_id=f"{name}_{OPTICAL}",
        width=columns,
        height=rows,
        encoding="32FC1",
        step=4 * columns,
        data=image.depth.astype("<f4").tobytes(),
    )


def calibration(name: str, camera: CameraModel, time: float) -> CameraCalibration:
    """Intrinsics of a camera. Pixels count from the centre of the first one."""
    matrix = camera.matrix
    matrix[:2, 2] -= 0.5
    return CameraCalibration(
        timestamp=stamp_of(time),
        frame_id=f"{name}_{OPTICAL}",
        width=camera.width,
        height=camera.height,
        distortion_model="plumb_bob" if camera.distortion else "",
        D=list(camera.distortion),
        K=matrix.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.hstack([matrix, np.zeros((3, 1))]).ravel().tolist(),
    )


def log_line(event: Event) -> Log:
    """The sentence of an event."""
    return Log(
        timestamp=stamp_of(event.time),
        level=_LEVELS.get(event.level, LogLevel.Info),
        message=event.text,
        name=event.source,
    )


def _span(scan: Scan) -> tuple[float, float]:
    """Directions of the first and the last of evenly spaced beams, radians.

    The beams of a turning lidar on a moving robot are not evenly spaced (stack.frames.deskew). The
    line through their bearings displaces their ends least: the sum of (range · error)² is minimal.
    """
    steps = scan.ranges.size - 1
    if scan.bearings is None or steps < 1:
        first = float(scan.angles[0])
        return first, first + scan.angle_increment * steps
    ranges = np.where(np.isfinite(scan.ranges), scan.ranges, scan.range_max)
    slope, first = np.polyfit(np.arange(steps + 1), np.unwrap(scan.bearings), 1, w=ranges)
    return float(first), float(first + slope * steps)


def _fixed(stamp: Timestamp, frame: LinkFrame) -> FrameTransform:
    return FrameTransform(
        timestamp=stamp,
        parent_frame_id=frame.parent,
        child_frame_id=frame.name,
        translation=vector(frame.position),
        rotation=_quaternion(frame.rotation),
    )


def _turn(heading: float) -> Quaternion:
    return Quaternion(x=0.0, y=0.0, z=sin(heading / 2.0), w=cos(heading / 2.0))


def _quaternion(rotation: Rotation) -> Quaternion:
    x, y, z, w = rotation
    return Quaternion(x=x, y=y, z=z, w=w)


def _rotation(rotation: FloatArray) -> FloatArray:
    """x, y, z, w of a rotation matrix: the eigenvector of its largest eigenvalue.

    I. Bar-Itzhack, "New method for extracting the quaternion from a rotation matrix", 2000.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    symmetric = np.array(
        [
            [xx - yy - zz, yx + xy, zx + xz, zy - yz],
            [yx + xy, yy - xx - zz, zy + yz, xz - zx],
            [zx + xz, zy + yz, zz - xx - yy, yx - xy],
            [zy - yz, xz - zx, yx - xy, xx + yy + zz],
        ]
    )
    _, vectors = np.linalg.eigh(symmetric / 3.0)
    found: FloatArray = vectors[:, -1]
    return found
