"""What a lidar sees of its own robot: the collision shapes of the URDF at its height."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from math import inf
from typing import Any

import numpy as np

from stack.drivetrain.description import LidarDescription
from stack.sim.physics.pybullet_engine import loader
from stack.sim.physics.pybullet_engine.robot import load_robot
from stack.types import FloatArray

REACH = 5.0
"""Metres that a robot extends at most beyond its lidar."""

TOUCHING = 1e-3
"""Radius, metres, of the ball at the sensor's place that finds the shapes it is in."""


@lru_cache(maxsize=32)
def own_ranges(model: str, lidar: LidarDescription) -> FloatArray:
    """See `PhysicsEngine.own_ranges`."""
    bullet = loader.load()
    client = bullet.connect(bullet.DIRECT)
    try:
        # Without this flag cylinders are meshes, which cannot be made again.
        robot = load_robot(bullet, client, model, bullet.URDF_USE_IMPLICIT_CYLINDER)
        place = (lidar.mount.x, lidar.mount.y, lidar.height)
        shapes = list(_shapes(bullet, client, robot))
        bullet.removeBody(robot, physicsClientId=client)
        ball = bullet.createCollisionShape(
            bullet.GEOM_SPHERE, radius=TOUCHING, physicsClientId=client
        )
        sensor = bullet.createMultiBody(0.0, ball, basePosition=place, physicsClientId=client)
        for shape in shapes:
            if bullet.getClosestPoints(sensor, shape, 0.0, physicsClientId=client):
                bullet.removeBody(shape, physicsClientId=client)
        bullet.removeBody(sensor, physicsClientId=client)
        directions = lidar.mount.heading + lidar.angles
        reach = REACH * np.column_stack(
            [np.cos(directions), np.sin(directions), np.zeros(directions.size)]
        )
        starts = np.tile(place, (directions.size, 1))
        hits = bullet.rayTestBatch(starts, starts + reach, numThreads=1, physicsClientId=client)
    finally:
        bullet.disconnect(physicsClientId=client)
    ranges = np.array([REACH * hit[2] if hit[0] >= 0 else inf for hit in hits])
    ranges.flags.writeable = False
    return ranges


def _shapes(bullet: Any, client: int, robot: int) -> Iterator[int]:
    """Make a body of each collision shape of a robot, and yield its number.

    Links on fixed joints are one in the simulation, so a housing is not a link of its own.
    """
    inertial = bullet.getDynamicsInfo(robot, -1, physicsClientId=client)[3:5]
    bullet.resetBasePositionAndOrientation(robot, *inertial, physicsClientId=client)
    for link in range(-1, bullet.getNumJoints(robot, physicsClientId=client)):
        centre = (
            inertial if link < 0 else bullet.getLinkState(robot, link, physicsClientId=client)[:2]
        )
        for data in bullet.getCollisionShapeData(robot, link, physicsClientId=client):
            kind, size, file, *pose = data[2:7]
            position, turn = bullet.multiplyTransforms(*centre, *pose)
            shape = _shape(bullet, client, kind, size, file)
            yield bullet.createMultiBody(
                0.0, shape, basePosition=position, baseOrientation=turn, physicsClientId=client
            )


def _shape(bullet: Any, client: int, kind: int, size: Sequence[float], file: bytes) -> int:
    """Make a collision shape as PyBullet describes it; `size` as in getCollisionShapeData."""
    if kind == bullet.GEOM_BOX:
        sizes: dict[str, Any] = {"halfExtents": [0.5 * side for side in size]}
    elif kind == bullet.GEOM_SPHERE:
        sizes = {"radius": size[0]}
    elif kind == bullet.GEOM_MESH:
        sizes = {"fileName": file.decode(), "meshScale": size}
    else:
        sizes = {"height": size[0], "radius": size[1]}
    number: int = bullet.createCollisionShape(kind, **sizes, physicsClientId=client)
    return number
