"""Evasion of people who walk towards the robot."""
