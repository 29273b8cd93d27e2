"""What a lidar sees of its own robot: the collision shapes of the URDF at its height."""

from __future__ import annotations

from functools import lru_cache
from math import inf
from pathlib import Path

import numpy as np

from stack.drivetrain.description import LidarDescription
from stack.sim.physics import bullet as loader
from stack.sim.physics.physics_robot import load_robot
from stack.types import FloatArray

REACH = 5.0
"""Metres that a robot extends at most beyond its lidar."""

TOUCHING = 1e-3
"""Radius, metres, of the ball at the sensor's place that finds the link it is in."""


@lru_cache(maxsize=32)
def own_ranges(urdf: Path, lidar: LidarDescription) -> FloatArray:
    """Return (beams,) the distance along each beam to the robot itself, metres; +inf: none.

    The link that the sensor is in is left out: its housing. Joints are at 0.

    Args:
        urdf: of the robot; its root frame is the base frame, on the floor.
        lidar: with its mount, height and beams.

    Raises:
        BodyError: the URDF cannot be read.
    """
    bullet = loader.load()
    client = bullet.connect(bullet.DIRECT)
    try:
        robot = load_robot(bullet, client, urdf)
        inertial = bullet.getDynamicsInfo(robot, -1, physicsClientId=client)[3:5]
        bullet.resetBasePositionAndOrientation(robot, *inertial, physicsClientId=client)
        place = (lidar.mount.x, lidar.mount.y, lidar.height)
        shape = bullet.createCollisionShape(
            bullet.GEOM_SPHERE, radius=TOUCHING, physicsClientId=client
        )
        ball = bullet.createMultiBody(0.0, shape, basePosition=place, physicsClientId=client)
        for contact in bullet.getClosestPoints(ball, robot, 0.0, physicsClientId=client):
            bullet.setCollisionFilterGroupMask(robot, contact[4], 0, 0, physicsClientId=client)
        bullet.removeBody(ball, physicsClientId=client)
        directions = lidar.mount.heading + lidar.angles
        reach = REACH * np.column_stack(
            [np.cos(directions), np.sin(directions), np.zeros(directions.size)]
        )
        starts = np.tile(place, (directions.size, 1))
        hits = bullet.rayTestBatch(
            starts, starts + reach, numThreads=1, collisionFilterMask=-1, physicsClientId=client
        )
    finally:
        bullet.disconnect(physicsClientId=client)
    ranges = np.array([REACH * hit[2] if hit[0] == robot else inf for hit in hits])
    ranges.flags.writeable = False
    return ranges
