"""Planar lidar: analytic ray casting in the scan plane, then noise and lost beams.

With a rotation time, each beam is measured from the pose of the robot at its own time; everything
else stands still during a scan.

A beam that meets a mirror is followed once more: its range is the whole way. One that meets a
second mirror has no return.

The scan plane is horizontal at the sensor's height. Ray tests on the physics mesh give the same
ranges and take thirty times as long (2.6 ms for 720 beams among 300 cylinders).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, pi

import numpy as np

from stack.compilation import KernelTypes
from stack.drivetrain.description import LidarDescription
from stack.sim.physics.meshes import box_outline, slab, wall_pillars, wall_slabs
from stack.sim.physics.mirrors import CLEAR_OF_MIRROR, mirror_faces, mirrors_at, reflected
from stack.sim.scene_state import RobotShape, SceneState
from stack.sim.worlds.world import PERSON_HEIGHT, Door, World
from stack.streams import stream
from stack.types import FloatArray, Pose2D, Scan, unwrapped

Trail = Sequence[tuple[float, Pose2D]]
"""Poses with their times, in order."""


class Lidar:
    """Takes scans from the sensor's true pose.

    A range is the true one plus Gaussian noise. Lost beams and ranges above the maximum are +inf,
    ranges below the minimum NaN. The noise depends only on (seed, name, step).

    Attributes:
        rotation_time: seconds of a full turn.
        duration: seconds from the first beam of a scan to the last.
    """

    @staticmethod
    def kernels(description: LidarDescription, world: World) -> KernelTypes:
        """Return the kernels that the scans of such a lidar in a world call."""
        from stack.sim.sensors import kernels

        along = kernels.ALONG if description.rotation_time > 0.0 else ()
        return (*along, *kernels.CAST, *(kernels.CAST_RAYS if mirror_faces(world) else ()))

    def __init__(  # noqa: PLR0913 - a sensor, its world and its robot
        self, description: LidarDescription, world: World, seed: int, name: str = "lidar",
        carrier: RobotShape | None = None, own: FloatArray | None = None,
    ) -> None:  # fmt: skip
        """Prepare scans.

        Args:
            description: of the lidar.
            world: with its fixed things and doors.
            seed: of the run; selects the noise.
            name: of its stream of random numbers.
            carrier: shape of the robot with the lidar, at any pose: what mirrors show of it.
            own: (beams,) distances along the beams to the robot itself; +inf: it is not there.
        """
        from stack.sim.sensors import kernels  # imports numba

        self._kernels, self._carrier = kernels, carrier
        self._description, self._seed, self._name = description, seed, name
        self._scene = SensedScene(world, description.height)
        n = description.beams
        self._increment, self._angle_min = description.angle_increment, description.angle_min
        self.rotation_time = description.rotation_time
        self._time_increment = self.rotation_time * self._increment / (2.0 * pi)
        self._times = self._time_increment * (np.arange(n) - (n - 1))
        self.duration = self._time_increment * (n - 1)
        self._beams, self._own = description.angles, own

    def scan(self, trail: Trail, scene: SceneState, step: int, time: float) -> Scan:
        """Measure one scan.

        Args:
            trail: true poses of the base with their times, the newest last, world frame. Without a
                rotation time only the newest is used.
            scene: everything else that moves.
            step: physics step; selects the noise.
            time: of the last beam, seconds; the stamp of the scan is that of its middle.
        """
        d = self._description
        outlines = self._scene.outlines(scene)
        stamp = time - 0.5 * (d.beams - 1) * self._time_increment
        beams = self._origins(trail, time)
        measured = self._kernels.cast(*beams, *outlines)
        if self._scene.mirrors.size:
            self._follow_reflections(measured, beams, trail[-1][1], outlines)
        if self._own is not None:
            np.minimum(measured, self._own, out=measured)
        self._add_errors(measured, step)
        return Scan(
            stamp=stamp,
            ranges=measured.astype(np.float32),
            angle_min=self._angle_min,
            angle_increment=self._increment,
            range_min=d.range_min,
            range_max=d.range_max,
            mount=d.mount,
            time_increment=self._time_increment,
        )

    def _origins(self, trail: Trail, time: float) -> tuple[FloatArray, FloatArray]:
        """Return (beams, 2) positions of the sensor and (beams,) increasing beam directions."""
        mount = self._description.mount
        if self.rotation_time == 0.0:
            sensor = trail[-1][1].compose(mount)
            at = np.full((self._beams.size, 2), (sensor.x, sensor.y))
            return at, sensor.heading + self._beams
        stamps, poses = _rows(trail)
        origins: FloatArray
        directions: FloatArray
        origins, directions = self._kernels.origins_along(
            time + self._times, stamps, poses, mount.x, mount.y, mount.heading, self._beams
        )
        return origins, directions

    def _follow_reflections(
        self, ranges: FloatArray, beams: tuple[FloatArray, FloatArray], robot: Pose2D,
        outlines: tuple[FloatArray, FloatArray],
    ) -> None:  # fmt: skip
        """Lengthen the ranges (beams,) of those that meet a mirror by the way after it."""
        (origins, directions), (segments, circles) = beams, outlines
        carrier, mirrors = self._carrier, self._scene.mirrors
        if carrier is not None and carrier.height > self._description.height:
            segments = np.concatenate([segments, replace(carrier, pose=robot).edges()])
        near = np.flatnonzero(ranges <= self._description.range_max)
        units = np.column_stack([np.cos(directions[near]), np.sin(directions[near])])
        ends = origins[near] + ranges[near, None] * units
        met = mirrors_at(ends, mirrors)
        hit = met >= 0
        if not hit.any():
            return
        onwards = reflected(units[hit], mirrors[met[hit]])
        begins = ends[hit] + CLEAR_OF_MIRROR * onwards
        after = self._kernels.cast_rays(begins, onwards, segments, circles)
        ended = np.flatnonzero(np.isfinite(after))
        again = mirrors_at(begins[ended] + after[ended, None] * onwards[ended], mirrors) >= 0
        after[ended[again]] = inf
        ranges[near[hit]] += after + CLEAR_OF_MIRROR

    def _add_errors(self, ranges: FloatArray, step: int) -> None:
        d = self._description
        random = stream(self._seed, self._name, step)
        ranges += random.normal(0.0, d.noise, d.beams)
        lost = random.random(d.beams) < d.dropout
        ranges[ranges < d.range_min] = np.nan
        ranges[lost | (ranges > d.range_max)] = inf


def _rows(trail: Trail) -> tuple[FloatArray, FloatArray]:
    """Return the times (k,) of a trail and its poses (k, 3), with headings without jumps."""
    poses = np.array([(pose.x, pose.y, pose.heading) for _, pose in trail])
    poses[:, 2] = unwrapped([pose.heading for _, pose in trail])
    return np.array([time for time, _ in trail]), poses


class SensedScene:
    """Outlines, in a horizontal plane at some height, of everything that reaches above it.

    Args:
        world: with its fixed things and doors.
        height: of the plane, metres above the floor.
        glass: whether walls of glass are contained.

    Attributes:
        mirrors: (k, 4) x, y, x, y of the faces of mirrors; they are also among the outlines.
    """

    def __init__(self, world: World, height: float, *, glass: bool = False) -> None:
        self._height = height
        faces = (face for face in mirror_faces(world) if face.bottom <= height < face.top)
        ends = [(*face.start, *face.end) for face in faces]
        self.mirrors = np.array(ends, dtype=np.float64).reshape(-1, 4)
        self._segments, self._circles = _static_outlines(world, height, glass=glass)
        self._doors = {door.name: _door(door) for door in world.doors if door.height > height}
        self._sees_people = height < PERSON_HEIGHT

    def outlines(self, scene: SceneState) -> tuple[FloatArray, FloatArray]:
        """Return segments (n, 4) x, y, x, y and circles (m, 3) x, y, radius, world frame."""
        closed = [lines for name, lines in self._doors.items() if scene.doors[name]]
        robots = [robot.edges() for robot in scene.robots if robot.height > self._height]
        circles = self._circles
        if self._sees_people and len(scene.people):
            circles = np.concatenate([circles, scene.people])
        if not closed and not robots:
            return self._segments, circles
        return np.concatenate([self._segments, *closed, *robots]), circles


def _static_outlines(world: World, height: float, *, glass: bool) -> tuple[FloatArray, FloatArray]:
    """Return segments (n, 4) and circles (m, 3) of the static parts at a height."""
    segments = [np.zeros((0, 4))]
    circles = [np.zeros((0, 3))]
    for wall in world.walls:
        if wall.height > height and (glass or not wall.glass):
            segments += [_edges(pose, length, wall.thickness) for pose, length in wall_slabs(wall)]
            pillars = wall_pillars(wall)
            circles.append(np.column_stack([pillars, np.full(len(pillars), wall.thickness / 2.0)]))
    for box in world.boxes:
        if box.reaches(height):
            segments.append(_edges(box.pose, box.size[0], box.size[1]))
    for cylinder in world.cylinders:
        if cylinder.height > height:
            circles.append(np.array([[cylinder.x, cylinder.y, cylinder.radius]]))
    return np.concatenate(segments), np.concatenate(circles)


def _door(door: Door) -> FloatArray:
    pose, length = slab(np.array(door.start), np.array(door.end))
    return _edges(pose, length, door.thickness)


def _edges(pose: Pose2D, length: float, width: float) -> FloatArray:
    """Return the four sides (4, 4) of a rectangle on the floor."""
    corners = box_outline(pose, length, width)
    return np.column_stack([corners, np.roll(corners, -1, axis=0)])
