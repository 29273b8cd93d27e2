"""Pose planners: paths that respect the robot's footprint and its turning radius."""
