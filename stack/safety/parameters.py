"""Settings of the safety stage."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class SafetyParameters:
    """Settings of `Safety`."""

    padding: float = parameter(
        0.03, "m", at_least=0.0, at_most=0.5, help="stays free round the footprint"
    )
    tight_padding: float = parameter(
        0.015, "m", at_least=0.0, at_most=0.5, help="stays free at tight_speed; lidar noise and so"
    )
    tight_speed: float = parameter(
        0.15, "m/s", at_least=0.0, help="what lies within the padding is passed no faster than this"
    )
    slow_time: float = parameter(
        1.0, "s", above=0.0, at_most=5.0, help="slower in proportion when contact is nearer"
    )
    reaction_time: float = parameter(
        0.15, "s", at_least=0.0, help="part of the stopping distance: scan, step and drive delay"
    )
    creep_speed: float = parameter(
        0.02, "m/s", at_least=0.0, help="stops rather than creep slower than this at something"
    )
    stale_after: float = parameter(
        0.3, "s", above=0.0, help="stops when the newest scan is older than this"
    )
    top_speed: float = parameter(
        5.0, "m/s", above=0.0, help="speed limit; the robot's own limit holds as well"
    )
    closed_loop: bool = parameter(
        False, help="changes of speed count from the measured velocity, not the last command"
    )
    dead_band: float = parameter(
        0.0, "m/s", at_least=0.0, at_most=0.5, help="the drive does not move slower than this"
    )
    turning_dead_band: float = parameter(
        0.0, "rad/s", at_least=0.0, at_most=1.0, help="the drive does not turn slower than this"
    )
