"""Drives that are planned on the map, and what they plan with: costmaps, route graph."""
