"""Finding codes and declarations that the readers of robot.yaml share."""

from __future__ import annotations

from math import pi

from stack.parameters import Declaration

SHAPE = "E301"
URDF = "E302"
FOOTPRINT = "E303"
ARM = "E304"
LEFT_OUT = "W302"
DIFFERS = "W303"

FARTHEST = 10.0
"""Largest coordinate or length on a robot, metres."""


def coordinate(name: str) -> Declaration:
    """Declare a coordinate in the base frame."""
    return Declaration(name, float, "base frame", "m", at_least=-FARTHEST, at_most=FARTHEST)


def length(name: str, help: str) -> Declaration:
    """Declare a length above 0."""
    return Declaration(name, float, help, "m", above=0.0, at_most=FARTHEST)


X, Y, Z = coordinate("x"), coordinate("y"), coordinate("z")
HEADING = Declaration("heading", float, "base frame", "rad", at_least=-2 * pi, at_most=2 * pi)
RADIUS = length("radius", "radius of the circle or wheel")

URDF_FILE = Declaration("file", str, "URDF or xacro file, relative to the robot file")
PACKAGES = Declaration(
    "packages", list[str], "folders with the packages that the file names", default=[]
)
