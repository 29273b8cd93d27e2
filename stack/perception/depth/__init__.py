"""Depth pictures: obstacles and missing floor, point clouds, virtual scans."""
