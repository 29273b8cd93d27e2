"""Commissioning of a robot: preflight checks, and calibration of odometry and mounts."""
