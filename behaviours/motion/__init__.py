"""Motions relative to the robot, without a plan: straight, turning, out of a tight spot."""
