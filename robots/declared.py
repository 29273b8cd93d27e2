"""Codes of findings and the values that several parts of a robot.yaml share."""

from __future__ import annotations

from math import pi

from stack.parameters import Declaration

SHAPE = "E301"
URDF = "E302"
FOOTPRINT = "E303"

FARTHEST = 10.0


def coordinate(name: str) -> Declaration:
    """A coordinate of something on the robot."""
    return Declaration(name, float, "base frame", "m", at_least=-FARTHEST, at_most=FARTHEST)


def length(name: str, help: str) -> Declaration:
    """A size of something on the robot."""
    return Declaration(name, float, help, "m", above=0.0, at_most=FARTHEST)


X, Y, Z = coordinate("x"), coordinate("y"), coordinate("z")
HEADING = Declaration("heading", float, "base frame", "rad", at_least=-2 * pi, at_most=2 * pi)
RADIUS = length("radius", "of a circle")
