"""Simulation on PyBullet: worlds, physics, sensors and people."""
