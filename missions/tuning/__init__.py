"""`treepilot tune`: score settings of a mission's components in the simulation.

ranges (parameters to try) · sampling (their values) · scoring (cost of a run) · tuning (the runs) ·
findings (table, JSON and parameter file).
"""
