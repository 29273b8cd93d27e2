"""Motions of an arm: kinematics, collisions, planning, timing and grasps."""
