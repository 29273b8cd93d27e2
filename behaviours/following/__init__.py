"""Driving along or behind what sensors see: walls, lines on the floor, people."""
