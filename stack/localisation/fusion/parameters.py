"""Parameters of the odometry filter, separate from the kernels so that they import no numba."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import ParameterError
from stack.localisation.parameters import OdometryFusionParameters
from stack.parameters import REQUIRED, parameter, suggestion

POSE_AXES, TWIST_AXES = ("x", "y", "heading"), ("linear", "lateral", "angular")
"""Axes of a source: of its pose in the odom frame, and of its twist in the base frame."""


@dataclass(frozen=True)
class SourceParameters:
    """A further source of pose and twist: a measurement of the body of the type `Odometry`."""

    sensor: str = parameter(REQUIRED, help="name of the measurement in the body's observations")
    pose: tuple[str, ...] = parameter((), help="axes of the pose that are used: x, y, heading")
    twist: tuple[str, ...] = parameter(
        (), help="axes of the twist that are used: linear, lateral, angular"
    )
    position_deviation: float = parameter(
        0.05, "m", above=0.0, help="standard deviation of a measured position"
    )
    heading_deviation: float = parameter(
        0.02, "rad", above=0.0, help="standard deviation of a measured heading"
    )
    speed_deviation: float = parameter(
        0.05, "m/s", above=0.0, help="standard deviation of a measured speed"
    )
    turn_deviation: float = parameter(
        0.05, "rad/s", above=0.0, help="standard deviation of a measured turning speed"
    )
    gate: float = parameter(
        4.0, above=0.0, help="measurements with a larger Mahalanobis distance are ignored"
    )
    timeout: float = parameter(
        1.0, "s", above=0.0,
        help="after so long without an accepted measurement the source's pose is aligned with the "
        "odometry again",
    )  # fmt: skip
    aligned: bool = parameter(
        True,
        help="align the source's own frame with the odom frame at its first measurement; otherwise "
        "its poses are in the odom frame",
    )  # fmt: skip

    def __post_init__(self) -> None:
        for name, axes, known in (
            ("pose", self.pose, POSE_AXES),
            ("twist", self.twist, TWIST_AXES),
        ):
            object.__setattr__(self, name, tuple(axes))  # files give a list
            for axis in axes:
                if axis not in known:
                    raise ParameterError(
                        name, f"{axis!r} is not one of {', '.join(known)}", suggestion(axis, known)
                    )
        if not (self.pose or self.twist):
            raise ParameterError(
                "twist", f"the source {self.sensor!r} has neither pose nor twist",
                "name its axes, e.g. `twist: [linear]`",
            )  # fmt: skip


@dataclass(frozen=True)
class EkfParameters(OdometryFusionParameters):
    """Errors of wheels, gyro and scan matching, and what counts as a disturbance."""

    history: float = parameter(
        1.0, "s", at_least=0.2, at_most=10.0,
        help="delayed measurements are used if they are at most this old",
    )  # fmt: skip
    distance_variance: float = parameter(
        2e-4, above=0.0, help="variance of the wheels' translation per metre, m²/m"
    )
    lateral_variance: float = parameter(
        2e-5, above=0.0, help="variance across the motion per metre, m²/m"
    )
    turn_variance: float = parameter(
        2e-3, above=0.0, help="variance of the wheels' rotation per radian turned, rad²/rad"
    )
    turn_variance_per_metre: float = parameter(
        5e-3, above=0.0, help="variance of the wheels' rotation per metre, rad²/m"
    )
    gyro_variance: float = parameter(
        2e-7, above=0.0,
        help="variance of the gyro's rotation per second, rad²/s; its noise density squared",
    )  # fmt: skip
    gyro_turn_variance: float = parameter(
        1e-6, at_least=0.0, help="variance of the gyro's rotation per radian turned, rad²/rad"
    )
    gyro_sample_deviation: float = parameter(
        0.004, "rad/s", above=0.0, help="standard deviation of one sample of the gyro"
    )
    bias_deviation: float = parameter(
        0.02, "rad/s", above=0.0, help="standard deviation of the gyro's bias at the start"
    )
    bias_variance: float = parameter(
        1e-10, above=0.0, help="growth of the variance of the gyro's bias, rad²/s³"
    )
    scale_deviation: float = parameter(
        0.01, at_least=0.0, at_most=0.2,
        help="standard deviation of the relative error of the wheels' diameter at the start",
    )  # fmt: skip
    disturbance_window: float = parameter(
        0.2, "s", at_least=0.05, at_most=2.0,
        help="time over which wheels are compared with gyro and accelerometer",
    )  # fmt: skip
    speed_tolerance: float = parameter(
        0.25, "m/s", above=0.0,
        help="the robot is disturbed if wheels and accelerometer disagree on the change of speed "
        "by more",
    )  # fmt: skip
    turn_tolerance: float = parameter(
        0.06, "rad", above=0.0,
        help="the robot is disturbed if wheels and gyro disagree on the rotation by more",
    )  # fmt: skip
    turn_tolerance_share: float = parameter(
        0.25, at_least=0.0, at_most=2.0, help="added to turn_tolerance, per radian turned"
    )
    disturbed_time: float = parameter(
        0.3, "s", above=0.0, help="wheels are used again after so long without disagreement"
    )
    disturbed_speed: float = parameter(
        2.0, "m/s", above=0.0,
        help="standard deviation of the velocity when a disturbance begins; rad/s for rotation",
    )  # fmt: skip
    disturbed_variance: float = parameter(
        20.0, above=0.0, help="growth of the variance of the velocity while disturbed, m²/s³"
    )
    disturbed_turn_deviation: float = parameter(
        1.0, "rad/s", above=0.0,
        help="standard deviation of the gyro while disturbed: it may have been beyond its range",
    )  # fmt: skip
    slip_decay: float = parameter(
        0.3, "s", above=0.0,
        help="time constant with which the velocity of a disturbed robot returns to the wheels'",
    )  # fmt: skip
    gate: float = parameter(
        4.0, above=0.0,
        help="Mahalanobis distance of a scan match from the wheels beyond which they disagree",
    )  # fmt: skip
    scan_matching: bool = parameter(True, public=True, help="match the scans of the lidar")
    lidar: str = parameter(
        "", public=True,
        help="name of the lidar whose scans are matched; empty: the robot's main lidar",
    )  # fmt: skip
    matching_range: float = parameter(
        12.0, "m", at_least=1.0, at_most=40.0, help="longer ranges are not matched"
    )
    matching_points: int = parameter(
        180, at_least=40, at_most=2000, help="points of a scan that are matched"
    )
    range_deviation: float = parameter(
        0.015, "m", above=0.0, help="standard deviation of a point from the line of a wall"
    )
    line_radius: float = parameter(
        0.2, "m", above=0.0, help="radius in which the points of a keyframe are joined to a line"
    )
    weakest_deviation: float = parameter(
        0.05, "m", above=0.0,
        help="scans fix no direction, e.g. along a corridor, whose deviation would be larger",
    )  # fmt: skip
    matching_deviation: float = parameter(
        0.002, "m", above=0.0, help="smallest standard deviation of a match"
    )
    matching_angle_deviation: float = parameter(
        0.001, "rad", above=0.0, help="smallest standard deviation of a match's heading"
    )
    matching_factor: float = parameter(
        4.0, at_least=1.0,
        help="factor of a match's variance, since the errors of neighbouring beams are related",
    )  # fmt: skip
    matching_share: float = parameter(
        0.6, above=0.0, at_most=1.0, help="share of the points that a match must explain"
    )
    searched_share: float = parameter(
        0.35, above=0.0, at_most=1.0,
        help="share of the points that a match after a push must explain; walls are hidden there",
    )  # fmt: skip
    matching_margin: float = parameter(
        0.08, at_least=0.0, at_most=1.0,
        help="a match explains this share of the points more than other poses nearby",
    )  # fmt: skip
    sudden_share: float = parameter(
        0.3, above=0.0, at_most=1.0,
        help="the robot was pushed if its predicted pose explains so much less of a scan than the "
        "last match did",
    )  # fmt: skip
    clear_share: float = parameter(
        0.5, above=0.0, at_most=1.0,
        help="a pose found after a push that explains less of a scan must be confirmed",
    )  # fmt: skip
    confirmations: int = parameter(
        3, at_least=1, help="scans in a row that must agree on a pose that needs confirmation"
    )
    known_deviation: float = parameter(
        0.2, "m", above=0.0,
        help="a pose found after a push is used if its position is known better than this",
    )  # fmt: skip
    jump_speed_deviation: float = parameter(
        0.2, "m/s", above=0.0,
        help="standard deviation of the wheels' velocity after a push was found; it may go on",
    )  # fmt: skip
    keyframe_distance: float = parameter(
        0.5, "m", above=0.0, help="distance from the keyframe at which the next one is set"
    )
    keyframe_angle: float = parameter(
        0.6, "rad", above=0.0, help="rotation from the keyframe at which the next one is set"
    )
    keyframe_share: float = parameter(
        0.75, above=0.0, at_most=1.0,
        help="the next keyframe is set if a match explains less of the points",
    )  # fmt: skip
    lost_matches: int = parameter(
        15, at_least=1, help="after so many scans without a match a new keyframe is set"
    )
    search_distance: float = parameter(
        2.2, "m", at_least=0.2, at_most=10.0, help="reach of the search after a push"
    )
    search_angle: float = parameter(
        1.2, "rad", at_least=0.1, at_most=3.2, help="reach of the search in heading"
    )
    sources: tuple[SourceParameters, ...] = parameter(
        (), public=True,
        help="further sources of pose and twist, each {sensor: NAME, pose: [x, y], …}",
    )  # fmt: skip

    def __post_init__(self) -> None:
        object.__setattr__(self, "sources", tuple(self.sources))  # files give a list
        names = [source.sensor for source in self.sources]
        if len(set(names)) < len(names):
            raise ParameterError(
                "sources", f"a sensor is listed twice in {', '.join(names)}",
                "write one entry with both pose and twist",
            )  # fmt: skip
