"""Smoothing by descent of the cost integral of a path."""
