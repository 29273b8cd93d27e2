"""Shortest curves between two poses for vehicles with a minimum turning radius."""
