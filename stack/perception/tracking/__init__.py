"""Tracking of moving objects in scans of a planar lidar."""
