"""Declared faults of simulated robots: kinds, when they happen, and what they do to a body."""
