"""Policies as controllers: what they observe, by name, and the velocities that they decide."""
