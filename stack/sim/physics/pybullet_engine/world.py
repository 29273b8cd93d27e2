"""PyBullet client with the bodies of a world file.

E. Coumans and Y. Bai, PyBullet, 2016-2021.
"""

from __future__ import annotations

from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

from stack.sim.physics.engine import GRAVITY
from stack.sim.physics.pybullet_engine import loader
from stack.sim.physics.pybullet_engine.scene import Scene, static_shape
from stack.sim.physics.settings import SimulationSettings
from stack.sim.worlds.world import World


class BulletWorld:
    """PyBullet client with the bodies of a world; robots are added to it.

    Args:
        world: the world to build.
        settings: physics rate and solver iterations.

    Attributes:
        bullet: the pybullet module.
        client: number of the client; -1 when closed.
        scene: the bodies of the world.
        friction: of the floor outside the friction zones.
        steps: physics steps so far.
    """

    def __init__(self, world: World, settings: SimulationSettings) -> None:
        self.bullet: Any = loader.load()
        self._world, self._settings = world, settings
        self._static = static_shape(world)
        self.friction = world.friction
        self.connect()

    def connect(self) -> None:
        """Connect to a new client and fill it; the one before must be closed."""
        bullet, settings = self.bullet, self._settings
        self.client: int = bullet.connect(bullet.DIRECT)
        self.steps = 0
        self._robots: dict[int, str] = {}
        try:
            bullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
            bullet.setPhysicsEngineParameter(
                fixedTimeStep=1.0 / settings.physics_rate,
                numSolverIterations=settings.solver_iterations,
                physicsClientId=self.client,
            )
            with TemporaryDirectory(prefix="treepilot-") as folder:
                self.scene = Scene.with_collision_shapes(
                    bullet, self.client, self._world, self._static, FilePath(folder)
                )
        except BaseException:
            self.close()
            raise

    def add_robot(self, body: int, name: str) -> None:
        """Register a robot by its body number; it is an obstacle of the other robots."""
        self._robots[body] = f"the robot {name}"

    def name_of(self, body: int) -> str:
        """Return what a body is, as used in sentences."""
        return self._robots.get(body) or self.scene.obstacles[body]

    def obstacles_of(self, robot: int) -> list[int]:
        """Return the body numbers of everything that a robot can collide with now."""
        there = (body for body in self.scene.obstacles if body not in self.scene.hidden)
        return [*there, *(body for body in self._robots if body != robot)]

    def step(self, count: int = 1) -> None:
        """Advance by `count` physics periods."""
        step, client = self.bullet.stepSimulation, self.client
        for _ in range(count):
            step(client)
        self.steps += count

    def close(self) -> None:
        """Disconnect. Safe to call twice."""
        if self.client >= 0:
            self.bullet.disconnect(physicsClientId=self.client)
            self.client = -1
