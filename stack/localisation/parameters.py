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
    hit_share: float = parameter(
        0.9, above=0.0, at_most=0.999, help="share of returns that the map explains"
    )
    trust: float = parameter(
        0.3, above=0.0, at_most=1.0,
        help="exponent of a scan's likelihood; below 1, since beams are not independent",
    )  # fmt: skip
    least_beams: float = parameter(
        0.25, at_least=0.0, at_most=1.0,
        help="beams that the map does not explain at a settled pose do not weight the particles "
        "while at least this share of the beams is left",
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
    odometry_scale: float = parameter(
        0.01, at_least=0.0, at_most=0.2,
        help="standard deviation of the scale of odometry's distances (wheel diameters, load); "
        "constant over a drive",
    )  # fmt: skip
    cell_deviation: float = parameter(
        0.35, at_least=0.0, at_most=5.0,
        help="standard deviation of the position by errors that all beams share, in cells of the "
        "map; a wall is anywhere within its cell: 0.29",
    )  # fmt: skip
    skid_factor: float = parameter(
        4.0, at_least=1.0, at_most=100.0,
        help="skid-steered robots: factor of alpha_1 and alpha_4; their wheels slide in turns",
    )  # fmt: skip
    short_object: float = parameter(
        1.0, at_least=0.0, at_most=20.0,
        help="evidence against a mode of an unmapped object 6 degrees wide (log-likelihood)",
    )  # fmt: skip
    long_object: float = parameter(
        2.0, at_least=0.0, at_most=20.0,
        help="evidence against a mode of a mapped object 6 degrees wide that is not there",
    )  # fmt: skip
    evidence_cap: float = parameter(
        15.0, above=0.0, at_most=100.0, help="largest evidence of one view against a mode"
    )
    rival_dead_zone: float = parameter(
        0.75, at_least=0.0, at_most=20.0,
        help="difference of the evidence of two modes that counts as none",
    )  # fmt: skip
    rival_lead: float = parameter(
        2.0, at_least=1.0, at_most=100.0,
        help="a mode becomes the estimate when it is this many times as probable",
    )  # fmt: skip
    max_modes: int = parameter(
        20, at_least=1, at_most=200, help="number of places that are followed at a time"
    )
    recover: bool = parameter(
        True, help="search the map by itself when the scans stop fitting; false: only when asked"
    )
    recovery_time: float = parameter(
        0.3, "s", at_least=0.0,
        help="time of badly fitting scans after which the pose is searched near the estimate",
    )  # fmt: skip
    recovery_period: float = parameter(
        0.5, "s", above=0.0, help="time between two searches near the estimate"
    )
    recovery_distance: float = parameter(
        1.0, "m", above=0.0, at_most=10.0,
        help="half the side of the first search window; it widens with each search",
    )  # fmt: skip
    recovery_angle: float = parameter(
        0.53, "rad", above=0.0, help="largest heading difference of the first search window"
    )
    global_period: float = parameter(
        3.0, "s", above=0.0, help="time between two searches of the whole map while lost"
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
    obscured_short: float = parameter(
        0.2, at_least=0.0, at_most=1.0,
        help="share of beams that end at unmapped things from which on they excuse a low health",
    )  # fmt: skip
    obscured_long: float = parameter(
        0.05, at_least=0.0, at_most=1.0,
        help="share of beams through mapped walls above which they do not excuse it",
    )  # fmt: skip
    health_window: float = parameter(
        1.0, "s", at_least=0.0, help="time window of scans whose median is the health"
    )
    # In a drawn office the 5th percentile of the fits is 0.67 with 7 obstacles, while 99 % of
    # kidnaps have a fit below 0.57 two seconds later.
    health_obstacles: int = parameter(
        7, at_least=0, at_most=50,
        help="up to so many people, moved chairs or closed doors around the robot are normal; "
        "more lower the health",
    )  # fmt: skip
    search_spacing: float = parameter(
        0.05, "m", at_least=0.02, at_most=1.0,
        help="distance between the positions that a search of the map tries",
    )  # fmt: skip
    search_heading_step: float = parameter(
        0.035, "rad", at_least=0.005, at_most=0.2,
        help="angle between the headings that a search of the map tries; 0.035 is 2 degrees",
    )  # fmt: skip
    search_blur: float = parameter(
        0.12, "m", at_least=0.02, at_most=2.0,
        help="standard deviation of a return in that search; above search_spacing",
    )  # fmt: skip
    search_beams: int = parameter(
        60, at_least=10, at_most=720, help="beams of each scan in that search"
    )
    search_fraction: float = parameter(
        0.7, above=0.0, at_most=1.0,
        help="the search returns the poses whose score is at least this share of the best one",
    )  # fmt: skip
    search_most: int = parameter(
        80, at_least=1, at_most=1000, help="largest number of poses that the search returns"
    )
    short_penalty: float = parameter(
        3.0, at_least=0.0, at_most=20.0,
        help="evidence against a pose of a beam that ends before the mapped wall (log-likelihood)",
    )  # fmt: skip
    long_penalty: float = parameter(
        6.0, at_least=0.0, at_most=20.0,
        help="evidence against a pose of a beam that passes through a mapped wall",
    )  # fmt: skip
    evidence_trust: float = parameter(
        0.2, above=0.0, at_most=1.0,
        help="factor of the evidence of 120 beams; below 1, since beams are not independent",
    )  # fmt: skip
    rival_share: float = parameter(
        0.01, above=0.0, at_most=1.0,
        help="another pose is a rival if its probability is at least this share of the best one's",
    )  # fmt: skip
    rival_distance: float = parameter(
        0.75, "m", above=0.0, help="distance driven after which a view is new evidence for rivals"
    )
    rival_angle: float = parameter(
        2.0, "rad", above=0.0, help="angle turned after which a view is new evidence for rivals"
    )
    push_distance: float = parameter(
        0.7, "m", above=0.0, at_most=10.0,
        help="standard deviation of the displacement by a push that odometry notices; ranks places "
        "that fit equally well",
    )  # fmt: skip
    push_angle: float = parameter(
        0.6, "rad", above=0.0, help="standard deviation of the rotation by such a push"
    )
    lifted_share: float = parameter(
        0.3, above=0.0, at_most=1.0,
        help="after a push, probability of a place far from the trusted pose, relative to one at "
        "it; 1: the trusted pose counts for nothing",
    )  # fmt: skip
    touch_distance: float = parameter(
        0.05, "m", at_least=0.0, at_most=0.5,
        help="distance from the body within which something unmapped touches it; 0: touches are "
        "not looked for",
    )  # fmt: skip
    touch_speed: float = parameter(
        0.15, "m/s", at_least=0.0, at_most=2.0,
        help="standard deviation of the speed at which what touches the robot may push it; the "
        "particles then spread also while its wheels stand",
    )  # fmt: skip
    carried_share: float = parameter(
        0.003, above=0.0, at_most=1.0,
        help="after a touch, probability of a place far from the trusted pose, relative to one at "
        "it; below rival_share such a place is no rival",
    )  # fmt: skip
    view_distance: float = parameter(
        15.0, "m", above=0.0, at_most=100.0,
        help="how far away a place is looked for at which rivals differ",
    )  # fmt: skip
    marker_outliers: float = parameter(
        0.02, above=0.0, at_most=0.5,
        help="share of the pictures whose markers are not where the map says",
    )  # fmt: skip
    marker_evidence: float = parameter(
        3.0, above=0.0, at_most=100.0,
        help="largest evidence of the markers in one picture for or against a mode",
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
    marker_outliers: float = parameter(
        0.02, above=0.0, at_most=0.5,
        help="share of the pictures whose markers are not where the map says",
    )  # fmt: skip


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
