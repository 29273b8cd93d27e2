"""Measured figures: `make bench`. Benchmarks measure; tests never assert wall time."""
