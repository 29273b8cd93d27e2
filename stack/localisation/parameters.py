"""Parameters of estimators and odometry, separate from the kernels so that they import no numba."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class LocaliserParameters:
    """Parameters of the particle filter, of its health and of the global search.

    alpha_1 to alpha_4 are those of the odometry motion model in Probabilistic Robotics (2005),
    table 5.6, in AMCL's convention: they scale variances. alpha_5 is from AMCL.
    """

    lidar: str = parameter(
        "", public=True,
        help="name of the lidar that weights the particles; empty: the robot's main lidar",
    )  # fmt: skip
    initial_position_deviation: float = parameter(
        0.1, "m", at_least=0.0, public=True,
        help="standard deviation of the initial position of the mission",
    )  # fmt: skip
    initial_heading_deviation: float = parameter(
        0.05, "rad", at_least=0.0, public=True,
        help="standard deviation of the initial heading of the mission",
    )  # fmt: skip
    min_particles: int = parameter(
        300, at_least=50, at_most=20000, not_above="max_particles", public=True,
        help="number of particles when the pose is certain",
    )  # fmt: skip
    max_particles: int = parameter(
        3000, at_least=50, at_most=20000, public=True, help="number of particles over the whole map"
    )
    kld_error: float = parameter(
        0.05, above=0.0, at_most=1.0,
        help="error of the distribution that sets the number of particles, as AMCL's pf_err",
    )  # fmt: skip
    kld_quantile: float = parameter(
        2.33, at_least=0.0, at_most=4.0,
        help="normal quantile of the probability that the error is kept; 2.33 is 99 %",
    )  # fmt: skip
    beams: int = parameter(
        60, at_least=10, at_most=720, public=True, help="beams of a scan that weight the particles"
    )
    hit_deviation: float = parameter(
        0.08, "m", above=0.0, at_most=1.0, help="standard deviation of a return from a mapped wall"
    )
    update_distance: float = parameter(
        0.05, "m", at_least=0.0, help="distance driven between two measurement updates"
    )
    update_angle: float = parameter(
        0.05, "rad", at_least=0.0, help="angle turned between two measurement updates"
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
    odometry_scale: float = parameter(
        0.01, at_least=0.0, at_most=0.2,
        help="standard deviation of the scale of odometry's distances (wheel diameters, load); "
        "constant over a drive",
    )  # fmt: skip
    recover: bool = parameter(
        True, help="search the map by itself when the scans stop fitting; false: only when asked"
    )
    range_noise: float = parameter(
        0.01, "m", at_least=0.0, help="standard deviation of a lidar range, for the health"
    )
    lost_health: float = parameter(
        0.3, at_least=0.0, at_most=1.0, not_above="good_health", public=True,
        help="health below which the robot counts as lost",
    )  # fmt: skip
    good_health: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="health from which on the pose counts as right"
    )
    # In a drawn office the 5th percentile of the fits is 0.67 with 7 obstacles, while 99 % of
    # kidnaps have a fit below 0.57 two seconds later.
    health_obstacles: int = parameter(
        7, at_least=0, at_most=50,
        help="up to so many people, moved chairs or closed doors around the robot are normal; "
        "more lower the health",
    )  # fmt: skip


@dataclass(frozen=True)
class DeadReckoningParameters:
    """Growth of the uncertainty with the motion; it does not change the pose."""

    distance_variance: float = parameter(
        2e-4, at_least=0.0,
        help="variance of the position per metre driven, m²/m; 2e-4 is 1.4 cm after a metre",
    )  # fmt: skip
    heading_variance_per_metre: float = parameter(
        1e-5, at_least=0.0, help="variance of the heading per metre driven, rad²/m"
    )
    heading_variance_per_radian: float = parameter(
        2e-4, at_least=0.0, help="variance of the heading per radian turned, rad²/rad"
    )


@dataclass(frozen=True)
class OdometryFusionParameters:
    """How wheels and gyro are combined, and when the gyro's bias is measured."""

    still_speed: float = parameter(
        0.003, "m/s", above=0.0, help="wheel speed below which the robot is at standstill"
    )
    still_turn: float = parameter(
        0.005, "rad/s", above=0.0,
        help="turning speed of the wheels below which the robot is at standstill",
    )  # fmt: skip
    settling_time: float = parameter(
        0.25, "s", at_least=0.0, help="time at standstill before the gyro's bias is measured"
    )
    gyro_timeout: float = parameter(
        0.1, "s", above=0.0,
        help="time without gyro samples after which the wheels measure the rotation",
    )  # fmt: skip
