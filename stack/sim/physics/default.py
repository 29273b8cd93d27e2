"""The physics engine that runs unless another one is chosen."""

from __future__ import annotations

from stack.sim.physics.engine import PhysicsEngine
from stack.sim.physics.pybullet_engine.engine import BulletEngine

DEFAULT_ENGINE: type[PhysicsEngine] = BulletEngine
