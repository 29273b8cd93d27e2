"""Occupancy grid from the scans of keyframes."""
