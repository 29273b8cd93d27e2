"""Parameters of the detection of coloured objects, in a module without heavy imports."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class ColourParameters:
    """Detection of coloured objects in camera pictures."""

    least_pixels: int = parameter(20, at_least=1, help="smaller patches are no objects")
    least_size: float = parameter(0.05, "m", at_least=0.0, help="smaller objects are ignored")
    farthest: float = parameter(8.0, "m", above=0.0, help="objects farther away are ignored")
