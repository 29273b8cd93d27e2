"""Parameters of the fiducial markers, in a module without heavy imports."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter
from stack.types import MARKER_DICTIONARIES

LARGEST_ERROR = 2.0
"""Reprojection error in pixels from which on a marker is elsewhere than the map says."""


@dataclass(frozen=True)
class MarkerParameters:
    """Use of fiducial markers: localisation while driving, and the survey of unknown markers."""

    localise: bool = parameter(
        False, public=True,
        help="every picture with known markers corrects the pose; the camera stays on",
    )  # fmt: skip
    survey: bool = parameter(
        False, public=True,
        help="measure the poses of markers that the map of markers does not have; `save_map` saves "
        "them; the camera stays on",
    )  # fmt: skip
    rate: float = parameter(
        5.0, "Hz", above=0.0, at_most=60.0,
        help="pictures that localisation and survey request; the camera's own rate is the limit",
    )  # fmt: skip
    update_distance: float = parameter(
        0.1, "m", at_least=0.0, at_most=5.0,
        help="the pose is corrected again after this distance: pictures from one place have the "
        "same errors",
    )  # fmt: skip
    update_angle: float = parameter(
        0.1, "rad", at_least=0.0, at_most=3.0, help="or after this angle"
    )
    pixel_noise: float = parameter(
        0.4, "px", above=0.0, at_most=10.0,
        help="standard deviation of a marker's corner in the image; scales the covariance",
    )  # fmt: skip
    mount_deviation: float = parameter(
        0.01, "m", at_least=0.0, at_most=0.5,
        help="standard deviation of the camera's position on the robot: an error that all pictures "
        "share; set it in the robot file",
    )  # fmt: skip
    mount_angle_deviation: float = parameter(
        0.005, "rad", at_least=0.0, at_most=0.5, help="likewise of its direction"
    )
    farthest: float = parameter(
        6.0, "m", above=0.0, help="markers farther away do not correct the pose"
    )
    surveyed_size: float = parameter(
        0.2, "m", above=0.0, at_most=2.0, help="side of the black square of surveyed markers"
    )
    surveyed_dictionary: str = parameter(
        "DICT_4X4_50", one_of=tuple(MARKER_DICTIONARIES), help="dictionary of surveyed markers"
    )
    least_views: int = parameter(
        5, at_least=2, help="views of a marker from which on the survey has its pose"
    )
