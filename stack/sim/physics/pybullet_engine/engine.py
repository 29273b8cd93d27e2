"""PyBullet as the physics engine."""

from __future__ import annotations

from collections.abc import Sequence

from stack.drivetrain.description import LidarDescription, RobotDescription
from stack.sim.physics.engine import PhysicsEngine
from stack.sim.physics.mirrors import MirrorFace
from stack.sim.physics.pybullet_engine.own_view import own_ranges
from stack.sim.physics.pybullet_engine.renderer import BulletRenderer
from stack.sim.physics.pybullet_engine.robot import BulletRobot
from stack.sim.physics.pybullet_engine.world import BulletWorld
from stack.sim.physics.settings import SimulationSettings
from stack.sim.sensors.requests import RenderSetup
from stack.sim.worlds.world import World
from stack.types import CameraModel, FloatArray, Pose2D


class BulletEngine(PhysicsEngine):
    """A PyBullet client with a world and its robots.

    Attributes:
        world: the client with the bodies of the world.
    """

    def __init__(self, world: World, settings: SimulationSettings) -> None:
        self.world = BulletWorld(world, settings)
        self._robots: list[BulletRobot] = []

    def add_robot(self, description: RobotDescription, start: Pose2D) -> BulletRobot:
        """As in `PhysicsEngine`."""
        robot = BulletRobot(self.world, description, start)
        self._robots.append(robot)
        return robot

    def reset(self) -> None:
        """As in `PhysicsEngine`: with a new client.

        Bullet's solver depends on the order in which bodies have met, which `restoreState` does not
        restore. The shapes of the world are kept; loading them takes some milliseconds.
        """
        self.world.close()
        self.world.connect()
        for robot in self._robots:
            robot.load()

    def step(self, count: int = 1) -> None:
        """As in `PhysicsEngine`."""
        self.world.step(count)

    def place_door(self, name: str, closed: bool) -> None:
        """As in `PhysicsEngine`."""
        self.world.scene.place_door(name, closed)

    def place_people(self, positions: Sequence[tuple[float, float]]) -> None:
        """As in `PhysicsEngine`."""
        self.world.scene.place_people(positions)

    def close(self) -> None:
        """As in `PhysicsEngine`."""
        self.world.close()

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
