"""Compiles a checked mission into a tree of py_trees nodes and runs it on the robot's clock.

`compiler.compile_mission` is the entry point. It returns a `mission_tree.MissionTree`, which the
runner ticks and `show` draws.
"""
