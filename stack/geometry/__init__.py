"""Plane geometry shared by the stack: polygons as arrays of corners."""
