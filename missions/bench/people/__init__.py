"""Benchmarks of driving among people."""
