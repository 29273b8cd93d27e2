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
    frozen_motion: float = parameter(
        0.05, above=0.0,
        help="motion meanwhile: metres driven plus radians turned. A robot that stands may see the"
        " same again and again",
    )  # fmt: skip
    least_valid: float = parameter(
        0.05, at_least=0.0, at_most=1.0,
        help="share of the pixels of a depth picture with a distance within range",
    )  # fmt: skip
    recovered_after: int = parameter(
        3, at_least=1, help="good pictures in a row after which the camera works again"
    )
