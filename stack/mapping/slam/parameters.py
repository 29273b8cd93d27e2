"""Parameters of SLAM, separate from the kernels so that they import no numba."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from stack.parameters import parameter
from stack.types import Pose2D


@dataclass(frozen=True)
class MapperParameters:
    """Parameters of scan matching, keyframes, loop closure and map rendering."""

    resolution: float = parameter(
        0.05, "m", at_least=0.01, at_most=0.5, public=True,
        help="side of a cell of the map and of the search",
    )  # fmt: skip
    match_range: float = parameter(
        30.0, "m", above=1.0, public=True, help="longer ranges are neither matched nor drawn"
    )
    clear_range: float = parameter(
        4.0, "m", at_least=0.0, help="distance that a beam without return clears in the map"
    )
    keyframe_distance: float = parameter(
        0.25, "m", above=0.0, at_most=5.0, help="distance driven from keyframe to keyframe"
    )
    keyframe_angle: float = parameter(
        0.25, "rad", above=0.0, at_most=3.0, help="angle turned from keyframe to keyframe"
    )
    odometry_distance_error: float = parameter(
        0.15, at_least=0.0, at_most=1.0, help="standard deviation of odometry per metre driven, m/m"
    )
    odometry_angle_error: float = parameter(
        0.15, at_least=0.0, at_most=1.0,
        help="standard deviation of odometry per radian turned, rad/rad",
    )  # fmt: skip
    residual_deviation: float = parameter(
        0.03, "m", above=0.0, at_most=0.5,
        help="standard deviation of a point from the surface that it is matched with",
    )  # fmt: skip
    reference_keyframes: int = parameter(
        12, at_least=1, at_most=50, help="keyframes that a scan is matched with"
    )
    reference_distance: float = parameter(
        4.0, "m", above=0.0, help="largest distance of these keyframes"
    )
    neighbour_edges: int = parameter(
        6, at_least=1, at_most=30, help="edges from a new keyframe to its neighbours, at most"
    )
    least_overlap: float = parameter(
        0.4, at_least=0.1, at_most=1.0, help="share of a scan's points that an edge explains"
    )
    loop_distance: float = parameter(
        6.0, "m", above=0.0, help="keyframes within this distance are candidates of a loop closure"
    )
    loop_drift: float = parameter(
        0.03, at_least=0.0, at_most=1.0,
        help="position error per metre driven that the search for loops allows for, m/m",
    )  # fmt: skip
    loop_angle: float = parameter(
        0.5, "rad", above=0.0, at_most=3.2, help="largest heading error of that search"
    )
    loop_score: float = parameter(
        0.6, above=0.0, at_most=1.0, help="score of a scan, in [0, 1], that a loop closure needs"
    )
    loop_overlap: float = parameter(
        0.65, above=0.0, at_most=1.0, help="share of a scan's points that a loop closure explains"
    )
    loop_scans: int = parameter(
        3, at_least=1, at_most=20, help="keyframes in a row that must agree on a loop closure"
    )
    loop_length: float = parameter(
        1.0, "m", at_least=0.0, help="distance driven while they agree, at least"
    )
    loop_conflict: float = parameter(
        0.1, at_least=0.0, at_most=1.0,
        help="share of the newest points that may lie in space which was free before",
    )  # fmt: skip
    loop_support: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="share of the newest points that must lie at its walls"
    )
    robust_scale: float = parameter(
        10.0, above=0.0,
        help="scale of dynamic covariance scaling: loop edges with a larger squared error than "
        "this, in standard deviations, lose weight",
    )  # fmt: skip
    place_keyframes: int = parameter(
        3, at_least=0, at_most=100,
        help="keyframes that are kept of one place; a scan that shows nothing new is not added. "
        "0 keeps all",
    )  # fmt: skip
    place_distance: float = parameter(
        0.5, "m", above=0.0, at_most=5.0, help="largest distance of keyframes of one place"
    )
    place_angle: float = parameter(
        0.6, "rad", above=0.0, at_most=3.2,
        help="largest angle between keyframes of one place, if the lidar does not see all around",
    )  # fmt: skip
    change_beams: int = parameter(
        6, at_least=1, help="beams that contradict the keyframes of a place in a scan with news"
    )
    change_scans: int = parameter(
        3, at_least=1, at_most=100,
        help="scans at different poses that must contradict a beam of a keyframe before the map "
        "forgets it",
    )  # fmt: skip
    marker_views: int = parameter(
        3, at_least=1, at_most=100,
        help="keyframes from which a marker must have been seen before it is part of the graph",
    )  # fmt: skip

    def odometry_deviation(self, moved: Pose2D) -> tuple[float, float]:
        """Return the standard deviations of position (m) and heading (rad) of a motion by odometry.

        They are proportional to the motion; 1 m driven counts for the heading as 0.3 rad turned.
        """
        distance = hypot(moved.x, moved.y)
        return (
            self.odometry_distance_error * distance,
            self.odometry_angle_error * (abs(moved.heading) + 0.3 * distance),
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
    map_period: float = parameter(
        1.0, "s", at_least=0.0, help="time between two updates of the costmap's map"
    )
    keyframes_per_step: int = parameter(
        5, at_least=1, at_most=1000,
        help="keyframes drawn again in a control step after a loop closure",
    )  # fmt: skip
    health_gain: float = parameter(
        0.1, above=0.0, at_most=1.0, help="share of a new scan in the health"
    )
    lost_health: float = parameter(
        0.3, at_least=0.0, at_most=1.0, not_above="good_health", public=True,
        help="health below which the robot counts as lost",
    )  # fmt: skip
    good_health: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="health from which on the pose counts as right"
    )
    search_period: float = parameter(
        5.0, "s", above=0.0,
        help="time between two searches of the whole map while the robot is lost on a saved map",
    )  # fmt: skip
