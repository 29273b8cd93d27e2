"""PyBullet as the physics engine; only this package imports it."""
