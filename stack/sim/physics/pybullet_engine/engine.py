"""PyBullet as the physics engine.

E. Coumans and Y. Bai, PyBullet, 2016-2021.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

from stack.body import BlockPose
from stack.drivetrain.description import LidarDescription, RobotDescription
from stack.sim.physics.engine import GRAVITY, PhysicsEngine
from stack.sim.physics.mirrors import MirrorFace
from stack.sim.physics.pybullet_engine import loader
from stack.sim.physics.pybullet_engine.own_view import own_ranges
from stack.sim.physics.pybullet_engine.renderer import BulletRenderer
from stack.sim.physics.pybullet_engine.robot import BulletRobot
from stack.sim.physics.pybullet_engine.scene import Scene, static_shape
from stack.sim.rates import PHYSICS_PERIOD
from stack.sim.sensors.requests import RenderSetup
from stack.sim.worlds.world import World
from stack.types import CameraModel, FloatArray, Pose2D

SOLVER_ITERATIONS = 20
"""Of the constraint solver, per physics step."""


class BulletEngine(PhysicsEngine):
    """A PyBullet client with the bodies of a world and its robots.

    Attributes:
        bullet: the pybullet module.
        client: number of the client; -1 when closed.
        scene: the bodies of the world.
    """

    def __init__(self, world: World) -> None:
        self.bullet: Any = loader.load()
        self._world = world
        self._static = static_shape(world)
        self._robots: list[BulletRobot] = []
        self._connect()

    def _connect(self) -> None:
        """Connect to a new client and fill it; the one before must be closed."""
        bullet = self.bullet
        self.client: int = bullet.connect(bullet.DIRECT)
        try:
            bullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
            bullet.setPhysicsEngineParameter(
                fixedTimeStep=PHYSICS_PERIOD,
                numSolverIterations=SOLVER_ITERATIONS,
                physicsClientId=self.client,
            )
            with TemporaryDirectory(prefix="treepilot-") as folder:
                self.scene = Scene.with_collision_shapes(
                    bullet, self.client, self._world, self._static, FilePath(folder)
                )
        except BaseException:
            self.close()
            raise

    def add_robot(self, description: RobotDescription, start: Pose2D) -> BulletRobot:
        """As in `PhysicsEngine`."""
        robot = BulletRobot(self.scene, description, start, self._world.friction)
        self._robots.append(robot)
        return robot

    def reset(self) -> None:
        """As in `PhysicsEngine`: with a new client.

        Bullet's solver depends on the order in which bodies have met, which `restoreState` does not
        restore. The shapes of the world are kept; loading them takes some milliseconds.
        """
        self.close()
        self._connect()
        for robot in self._robots:
            robot.load(self.scene)

    def step(self, count: int = 1) -> None:
        """As in `PhysicsEngine`."""
        step, client = self.bullet.stepSimulation, self.client
        for _ in range(count):
            step(client)
        for robot in self._robots:
            robot.note_step()

    def place_door(self, name: str, closed: bool) -> None:
        """As in `PhysicsEngine`."""
        self.scene.place_door(name, closed)

    def blocks(self) -> list[BlockPose]:
        """As in `PhysicsEngine`."""
        return self.scene.block_states()

    def drop_box(self, pose: Pose2D, size: tuple[float, float, float]) -> None:
        """As in `PhysicsEngine`."""
        self.scene.drop_box(pose, size)

    def place_people(self, positions: Sequence[tuple[float, float]]) -> None:
        """As in `PhysicsEngine`."""
        self.scene.place_people(positions)

    def close(self) -> None:
        """As in `PhysicsEngine`."""
        if self.client >= 0:
            self.bullet.disconnect(physicsClientId=self.client)
            self.client = -1

    @classmethod
    def own_ranges(cls, model: str, lidar: LidarDescription) -> FloatArray:
        """As in `PhysicsEngine`."""
        return own_ranges(model, lidar)

    @classmethod
    def renderer(
        cls, setup: RenderSetup, model: CameraModel, mirror: MirrorFace | None = None
    ) -> BulletRenderer:
        """As in `PhysicsEngine`."""
        return BulletRenderer(setup, model, mirror)
