"""Parameters of the localisation, separate from the kernels so that they import no numba."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class LocaliserParameters:
    """Parameters of the particle filter, of its health and of the global search.

    alpha_1 to alpha_4 are those of the odometry motion model in Probabilistic Robotics (2005),
    table 5.6, in AMCL's convention: they scale variances. alpha_5 is from AMCL.
    """

    lidar: str = parameter("lidar", help="name of the lidar that weights the particles")
    min_particles: int = parameter(
        300, at_least=50, at_most=20000, help="number of particles when the pose is certain"
    )
    max_particles: int = parameter(
        3000, at_least=50, at_most=20000, help="number of particles over the whole map"
    )
    beams: int = parameter(
        60, at_least=10, at_most=720, help="beams of a scan that weight the particles"
    )
    hit_deviation: float = parameter(
        0.08, "m", above=0.0, at_most=1.0, help="standard deviation of a return from a mapped wall"
    )
    hit_share: float = parameter(
        0.9, above=0.0, at_most=0.999, help="share of returns that the map explains"
    )
    trust: float = parameter(
        0.3, above=0.0, at_most=1.0,
        help="exponent of a scan's likelihood; below 1, since beams are not independent",
    )  # fmt: skip
    update_distance: float = parameter(
        0.05, "m", at_least=0.0, help="distance driven between two measurement updates"
    )
    update_angle: float = parameter(
        0.05, "rad", at_least=0.0, help="angle turned between two measurement updates"
    )
    settled_deviation: float = parameter(
        0.25, "m", above=0.0, help="the pose is settled if its deviation is below this"
    )
    alpha_1: float = parameter(
        0.01, at_least=0.0, at_most=2.0, help="variance of rotation per rotation squared"
    )
    alpha_2: float = parameter(
        0.01, at_least=0.0, at_most=2.0, help="variance of rotation per translation squared"
    )
    alpha_3: float = parameter(
        0.02, at_least=0.0, at_most=2.0, help="variance of translation per translation squared"
    )
    alpha_4: float = parameter(
        0.001, at_least=0.0, at_most=2.0, help="variance of translation per rotation squared"
    )
    alpha_5: float = parameter(
        0.02, at_least=0.0, at_most=2.0,
        help="omnidirectional robots: variance across the motion per translation squared",
    )  # fmt: skip
    range_noise: float = parameter(
        0.01, "m", at_least=0.0, help="standard deviation of a lidar range, for the health"
    )
    health_window: float = parameter(
        1.0, "s", at_least=0.0, help="time window of scans whose median is the health"
    )
    ambiguity_ratio: float = parameter(
        0.85, above=0.0, at_most=1.0,
        help="the pose is ambiguous if a second place has this share of the best fit",
    )  # fmt: skip
