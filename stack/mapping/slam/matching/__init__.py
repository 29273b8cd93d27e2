"""Scan matching: search by branch and bound, point-to-line alignment."""
