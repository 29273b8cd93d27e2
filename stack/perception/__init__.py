"""Perception: obstacles of all sensors, tracked objects, and what pictures and depth show."""
