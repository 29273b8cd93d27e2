"""Layers of costmaps: each one source of costs, e.g. the map, a lidar or zones."""
