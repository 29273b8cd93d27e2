"""Transforms between the map, odom and base frames, by time stamp."""
