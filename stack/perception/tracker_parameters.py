"""Settings of the tracker of moving things."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class TrackerParameters:
    """How moving things are found in scans and followed."""

    range: float = parameter(8.0, "m", above=0.0, help="looks no farther than this")
    jump: float = parameter(
        0.3, "m", above=0.0, help="neighbouring returns farther apart belong to different things"
    )
    least_beams: int = parameter(3, at_least=2, help="fewer returns are no thing")
    largest_radius: float = parameter(0.7, "m", above=0.0, help="what is larger is a wall")
    map_margin: float = parameter(
        0.15, "m", at_least=0.0, help="returns as near to the map's obstacles belong to the map"
    )
    gate: float = parameter(
        9.21, above=0.0, help="largest squared Mahalanobis distance of a match; 9.21 holds 99 %"
    )
    acceleration: float = parameter(
        1.0,
        "m/s²",
        above=0.0,
        help="deviation of the acceleration that people are believed to have",
    )
    position_noise: float = parameter(
        0.05, "m", above=0.0, help="deviation of a thing's middle as one scan gives it"
    )
    first_speed: float = parameter(
        1.0, "m/s", above=0.0, help="deviation of the velocity of what is seen for the first time"
    )
    confirm: int = parameter(4, at_least=2, help="seen this often, a thing is believed in")
    forget: float = parameter(1.0, "s", above=0.0, help="unseen for this long, a thing is gone")
    moving_speed: float = parameter(
        0.25, "m/s", above=0.0, help="what was never this fast does not move"
    )
    moving_distance: float = parameter(
        0.3, "m", at_least=0.0, help="what never came this far does not move, nor does its noise"
    )
