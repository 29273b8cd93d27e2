"""Plane geometry shared by the stack: polygons, paths and progress on them, distances on grids."""
