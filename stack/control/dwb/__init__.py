"""Sampling of velocities within the dynamic window."""
