"""Running trees: what a checked mission compiles to, on py_trees, with the robot's clock.

`compiler.compile_mission` is the way in; `mission_tree.MissionTree` is what comes out and what the
runner ticks; `show` draws it.
"""
