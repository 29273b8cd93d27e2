"""Simulated worlds, sensors and physics, on PyBullet."""
