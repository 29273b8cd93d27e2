"""Transforms between frames: on the floor by time stamp, and in space along a tree."""
