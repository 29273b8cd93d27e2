"""Shortest curves between two poses for vehicles that cannot turn on the spot."""
