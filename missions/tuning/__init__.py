"""`treepilot tune`: search better settings of a mission in simulation, by Optuna.

objectives (what is better) · study (Optuna's) · tuning (the runs) · scoring (settings compared) ·
results (table, JSON and parameter files) · page.
"""
