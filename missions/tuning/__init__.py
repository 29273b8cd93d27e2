"""`treepilot tune`: tries settings of a mission's components in the simulation and scores them.

ranges (what to try) · sampling (which values) · scoring (cost of a run) · tuning (all of it) ·
findings (table, JSON and the parameter file).
"""
