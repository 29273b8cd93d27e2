"""Benchmark of the localisation: tracking, pushes, kidnaps, unknown starts, twin rooms, health."""
