"""Benchmarks: generated or published worlds, missions over seeds, scores and tables."""
