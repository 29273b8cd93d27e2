"""`treepilot test`: runs the cases under `tests` of mission files, without a robot or a simulator.

`session.run_files` is the way in.
"""
