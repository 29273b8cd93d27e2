"""Parameters of the obstacles from depth cameras, in a module without heavy imports."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class DepthParameters:
    """Use of the depth cameras."""

    obstacles: bool = parameter(
        False, public=True,
        help="what depth cameras see is an obstacle; without it they take no pictures",
    )  # fmt: skip
    lowest: float = parameter(
        0.04, "m", above=0.0, help="height above the floor from which on a point is an obstacle"
    )
    clearance: float = parameter(
        0.05, "m", at_least=0.0, help="distance above the robot that counts as in its way"
    )
    deepest: float = parameter(
        0.04, "m", above=0.0, help="depth below the floor from which on the floor ends"
    )
    tilt: float = parameter(
        0.015, "rad", at_least=0.0,
        help="error of the camera's pitch; widens `lowest` and `deepest` with the distance",
    )  # fmt: skip
    voxel: float = parameter(0.05, "m", at_least=0.01, help="side of a voxel")
    least_pixels: int = parameter(
        3, at_least=1, help="pixels in a voxel that make it an obstacle or a missing floor"
    )
    memory: float = parameter(
        60.0, "s", at_least=0.0, help="how long a point is kept that no picture shows again"
    )
