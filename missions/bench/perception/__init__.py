"""Benchmarks of behaviours that steer by what they perceive: lines and docks."""
