"""Parameters of the tracker of moving objects."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class TrackerParameters:
    """Parameters of the detection and tracking of moving objects."""

    range: float = parameter(12.0, "m", above=0.0, help="largest range of a return")
    jump: float = parameter(
        0.3, "m", above=0.0, help="neighbouring returns farther apart belong to different objects"
    )
    least_beams: int = parameter(3, at_least=2, help="smallest number of returns of an object")
    largest_radius: float = parameter(0.7, "m", above=0.0, help="larger objects count as walls")
    map_margin: float = parameter(
        0.15, "m", at_least=0.0, help="returns this close to a mapped obstacle belong to the map"
    )
    gate: float = parameter(
        9.21, above=0.0, help="largest squared Mahalanobis distance of a match; 9.21 covers 99 %"
    )
    acceleration: float = parameter(
        2.0,
        "m/s²",
        above=0.0,
        help="standard deviation of an object's acceleration",
    )
    position_noise: float = parameter(
        0.05, "m", above=0.0, help="standard deviation of an object's centre in one scan"
    )
    first_speed: float = parameter(
        1.0, "m/s", above=0.0, help="standard deviation of the velocity of a new track"
    )
    confirm: int = parameter(3, at_least=2, help="number of detections that confirm a track")
    forget: float = parameter(1.0, "s", above=0.0, help="a track not seen for this time is removed")
    moving_speed: float = parameter(
        0.25, "m/s", above=0.0, help="an object counts as moving if it has reached this speed"
    )
    standing_time: float = parameter(
        10.0, "s", at_least=0.0,
        help="paths lead past people who have stood for less than this; then they are obstacles",
    )  # fmt: skip
    moving_distance: float = parameter(
        0.15, "m", at_least=0.0, help="and if it has come this far from its first position"
    )
