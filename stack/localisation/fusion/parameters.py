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
    """Sources of the odometry filter, and how long it remembers."""

    history: float = parameter(
        1.0, "s", at_least=0.2, at_most=10.0,
        help="delayed measurements are used if they are at most this old",
    )  # fmt: skip
    scan_matching: bool = parameter(True, public=True, help="match the scans of the lidar")
    lidar: str = parameter(
        "", public=True,
        help="name of the lidar whose scans are matched; empty: the robot's main lidar",
    )  # fmt: skip
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
