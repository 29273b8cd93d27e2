"""Benchmarks against figures that others published: missions to run and their scoring."""
