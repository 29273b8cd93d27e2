"""What can be set about the localisation. Stands apart from the kernels: no numba here."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class LocaliserParameters:
    """Settings of the particle filter, of its health and of the global search.

    alpha_1 to alpha_4 are those of the odometry motion model in Probabilistic Robotics (2005),
    table 5.6, in AMCL's convention: they scale variances. alpha_5 is AMCL's own.
    """

    min_particles: int = parameter(300, at_least=50, at_most=20000, help="when sure of the pose")
    max_particles: int = parameter(3000, at_least=50, at_most=20000, help="when anywhere")
    beams: int = parameter(60, at_least=10, at_most=720, help="beams that weigh the particles")
    hit_deviation: float = parameter(
        0.08, "m", above=0.0, at_most=1.0, help="of a return from a wall that the map shows"
    )
    hit_share: float = parameter(
        0.9, above=0.0, at_most=0.999, help="share of returns that the map explains"
    )
    trust: float = parameter(
        0.3, above=0.0, at_most=1.0,
        help="exponent of a scan's likelihood, its beams not being independent"
    )  # fmt: skip
    update_distance: float = parameter(
        0.05, "m", at_least=0.0, help="driven before the next scan weighs the particles"
    )
    update_angle: float = parameter(
        0.05, "rad", at_least=0.0, help="turned before the next scan weighs the particles"
    )
    settled_deviation: float = parameter(
        0.25, "m", above=0.0, help="deviation of the position below which the pose counts as known"
    )
    alpha_1: float = parameter(
        0.01, at_least=0.0, at_most=2.0, help="turning's variance per turning squared"
    )
    alpha_2: float = parameter(
        0.01, at_least=0.0, at_most=2.0, help="turning's variance per distance squared"
    )
    alpha_3: float = parameter(
        0.02, at_least=0.0, at_most=2.0, help="distance's variance per distance squared"
    )
    alpha_4: float = parameter(
        0.001, at_least=0.0, at_most=2.0, help="distance's variance per turning squared"
    )
    alpha_5: float = parameter(
        0.02, at_least=0.0, at_most=2.0,
        help="omnidirectional robots: variance across the way per distance squared",
    )  # fmt: skip
    range_noise: float = parameter(
        0.01, "m", at_least=0.0, help="deviation of a lidar range, for calibrating the health"
    )
    health_window: float = parameter(
        1.0, "s", at_least=0.0, help="the health is the median over the scans of this time"
    )
    ambiguity_ratio: float = parameter(
        0.85, above=0.0, at_most=1.0,
        help="a second place that fits this well, compared with the best, makes it ambiguous",
    )  # fmt: skip
