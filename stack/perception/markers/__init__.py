"""Fiducial markers: detection, the robot's pose with its covariance, survey of unknown markers."""
