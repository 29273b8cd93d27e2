"""Benches of driving, one a file: each defines BENCHMARKS by name, which the command line finds."""
