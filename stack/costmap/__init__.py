"""Layered costmaps: the cost of driving through each cell."""
