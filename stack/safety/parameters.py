"""Parameters of the safety stage."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import ParameterError
from stack.parameters import parameter

PADDING_SLACK = 0.005
"""Metres by which a point within the padding may still come nearer: noise of the sensors."""


@dataclass(frozen=True)
class SafetyParameters:
    """Parameters of `Safety`."""

    padding: float = parameter(
        0.03, "m", at_least=0.0, at_most=0.5, public=True,
        help="distance kept free around the footprint at padding_speed and above",
    )  # fmt: skip
    tight_padding: float = parameter(
        0.015, "m", at_least=0.0, at_most=0.5,
        help="distance kept free up to tight_speed; if not below padding, padding always holds",
    )  # fmt: skip
    tight_speed: float = parameter(
        0.15, "m/s", at_least=0.0, not_above="padding_speed",
        help="highest speed of any point of the robot past an obstacle tight_padding away; "
        "0: padding always holds",
    )  # fmt: skip
    padding_speed: float = parameter(
        0.6, "m/s", at_least=0.0,
        help="highest speed past an obstacle almost padding away; between the two distances the "
        "limit rises linearly. Higher: faster through gaps",
    )  # fmt: skip
    slow_time: float = parameter(
        1.0, "s", above=0.0, at_most=5.0, help="time to contact below which the speed is reduced"
    )
    reaction_time: float = parameter(
        0.15,
        "s",
        at_least=0.0,
        at_most=5.0,
        help="delay of scan, step and drive, added to the stopping time",
    )
    creep_speed: float = parameter(
        0.02, "m/s", above=0.0, help="stops at an obstacle instead of driving slower than this"
    )
    stale_after: float = parameter(
        0.3,
        "s",
        above=0.0,
        help="maximum age of a lidar's or sonar's measurement; the robot stops above it",
    )
    picture_slow_after: float = parameter(
        0.3, "s", above=0.0,
        help="age of a depth camera's picture above which the speed is limited; obstacles that it"
        " has seen are still known",
    )  # fmt: skip
    picture_slow_speed: float = parameter(
        0.15, "m/s", at_least=0.0, help="speed limit of every point of the outline then"
    )
    picture_stop_after: float = parameter(
        1.0, "s", above=0.0, help="age of a depth camera's picture above which the robot stops"
    )
    predict_motion: bool = parameter(
        True, help="expect tracked objects where their velocity takes them, not where they are"
    )
    moving_padding: float = parameter(
        0.1, "m", at_least=0.0, at_most=0.5, help="distance kept to people and things that walk"
    )
    blind_speed: float = parameter(
        0.15, "m/s", at_least=0.0, public=True,
        help="speed limit towards a sector no sensor covers, and of an outline in unseen ground",
    )  # fmt: skip
    top_speed: float = parameter(
        5.0, "m/s", above=0.0, public=True, help="speed limit, in addition to the robot's own"
    )
    closed_loop: bool = parameter(
        False, help="limit accelerations from the measured velocity, not the last command"
    )
    dead_band: float = parameter(
        0.0, "m/s", at_least=0.0, at_most=0.5, help="the drive does not move slower than this"
    )
    turning_dead_band: float = parameter(
        0.0, "rad/s", at_least=0.0, at_most=1.0, help="the drive does not turn slower than this"
    )

    def __post_init__(self) -> None:
        """Raise ParameterError for a robot that would creep into an obstacle.

        It stops where its share of the speed falls below `creep_speed`: this must be before the
        slack to the obstacle is used up.
        """
        stops_at = self.creep_speed * self.slow_time
        if stops_at <= PADDING_SLACK:
            raise ParameterError(
                "creep_speed",
                f"{self.creep_speed:g} m/s times slow_time {self.slow_time:g} s is {stops_at:.2g} "
                f"m, not above {PADDING_SLACK:g} m: the robot would creep into obstacles",
                f"use more than {PADDING_SLACK / self.slow_time:.2g} m/s, or a longer slow_time",
            )
