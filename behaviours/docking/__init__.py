"""Driving to a charging dock and away from it."""
