"""`treepilot test`: runs the test cases of mission files without a robot or a simulator.

`session.run_files` is the entry point.
"""
