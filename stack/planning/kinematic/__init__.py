"""Planners that search poses: what the robot's outline and its steering allow."""
