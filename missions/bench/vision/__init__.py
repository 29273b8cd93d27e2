"""Benchmarks of cameras: line following."""
