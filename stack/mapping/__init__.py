"""Occupancy grids from ROS map files, and the passages of a map."""
