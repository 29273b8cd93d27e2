"""Parameters of the detection of coloured objects, in a module without heavy imports."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class ColourParameters:
    """Detection of coloured objects in camera pictures."""

    hue_tolerance: float = parameter(
        0.35, "rad", above=0.0, at_most=1.0, help="largest difference from the colour's hue"
    )
    least_saturation: float = parameter(
        0.5, above=0.0, at_most=1.0, help="saturation from which on a pixel has a hue"
    )
    least_value: float = parameter(
        0.12, above=0.0, at_most=1.0, help="brightness from which on a pixel has a hue"
    )
    least_pixels: int = parameter(20, at_least=1, help="smaller patches are no objects")
    least_size: float = parameter(0.05, "m", at_least=0.0, help="smaller objects are ignored")
    farthest: float = parameter(8.0, "m", above=0.0, help="objects farther away are ignored")
