"""Parameters of the watch on cameras, in a module without heavy imports."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class CameraParameters:
    """When a camera counts as faulty. Its pictures are then ignored, but for late ones."""

    silent_after: float = parameter(
        1.0, "s", above=0.0, help="time without a picture, while pictures are requested"
    )
    late_after: float = parameter(
        0.5, "s", above=0.0, help="age of a picture on arrival above which it is late"
    )
    frozen_pictures: int = parameter(
        5, at_least=0,
        help="equal pictures in a row, while the robot moves, that mean the camera is frozen;"
        " 0: never",
    )  # fmt: skip
