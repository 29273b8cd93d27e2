"""Parameters of SLAM, separate from the kernels so that they import no numba."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class MapperParameters:
    """Parameters of scan matching, keyframes and map rendering."""

    resolution: float = parameter(
        0.05, "m", at_least=0.01, at_most=0.5, public=True,
        help="side of a cell of the map and of the search",
    )  # fmt: skip
    match_range: float = parameter(
        30.0, "m", above=1.0, public=True, help="longer ranges are neither matched nor drawn"
    )


@dataclass(frozen=True)
class SlamParameters(MapperParameters):
    """Parameters of the estimator `slam`: those of the mapper, and how it runs in a mission."""

    lidar: str = parameter(
        "", public=True, help="name of the lidar that maps; empty: the robot's main lidar"
    )
    latency: float = parameter(
        1.0, "s", at_least=0.0, at_most=60.0,
        help="time from a loop closure to the corrected map; the optimisation runs meanwhile",
    )  # fmt: skip
    lost_health: float = parameter(
        0.3, at_least=0.0, at_most=1.0, not_above="good_health", public=True,
        help="health below which the robot counts as lost",
    )  # fmt: skip
    good_health: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="health from which on the pose counts as right"
    )
