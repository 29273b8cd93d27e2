"""Tables of equivalent parameters: Nav2's name -> treepilot's name and conversion.

Names and meanings are from the declarations in Nav2's sources (navigation2, main branch, 2026).
Values with the same meaning and unit are copied. Weights in another unit without an exact
conversion are left out: a number tuned for another unit is worse than the default.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from stack.costmap.choosing import SENSORS


def _same(value: Any) -> Any:
    return value


def _opposite(value: Any) -> Any:
    """Convert a limit that Nav2 writes as a negative velocity."""
    return max(0.0, -value)


@dataclass(frozen=True, slots=True)
class Equivalent:
    """A treepilot parameter and the conversion of its value; a result of None is not imported."""

    name: str
    convert: Callable[[Any], Any] = _same


Table = Mapping[str, Equivalent]


def _renamed(**names: str) -> dict[str, Equivalent]:
    return {nav2: Equivalent(name) for nav2, name in names.items()}


def _scaled(name: str, factor: float) -> Equivalent:
    return Equivalent(name, lambda value: value * factor)


PURE_PURSUIT: Table = {
    **_renamed(
        desired_linear_vel="cruise_speed",
        max_linear_vel="cruise_speed",
        lookahead_time="lookahead_time",
        min_lookahead_dist="min_lookahead",
        max_lookahead_dist="max_lookahead",
        rotate_to_heading_angular_vel="turn_speed",
        rotate_to_heading_min_angle="turn_angle",
        regulated_linear_scaling_min_radius="min_radius",
        regulated_linear_scaling_min_speed="min_speed",
        min_approach_linear_velocity="creep_speed",
        max_allowed_time_to_collision_up_to_carrot="time_to_collision",
    ),
    "min_distance_to_obstacle": Equivalent("clearance", lambda v: v if v >= 0.0 else None),
    "use_regulated_linear_velocity_scaling": Equivalent("min_radius", lambda v: None if v else 0.0),
    "use_cost_regulated_linear_velocity_scaling": Equivalent(
        "cost_slowdown", lambda v: None if v else 0.0
    ),
}

MPPI: Table = {
    **_renamed(
        vx_max="cruise_speed",
        vy_max="lateral_speed",
        wz_max="turn_speed",
        batch_size="batch",
        time_steps="steps",
        model_dt="time_step",
        iteration_count="iterations",
        temperature="temperature",
        gamma="gamma",
        vx_std="linear_deviation",
        wz_std="angular_deviation",
    ),
    "vx_min": Equivalent("reverse_speed", _opposite),
    "vy_std": Equivalent("lateral_deviation", lambda v: v or None),
}

MPPI_CRITICS: Mapping[str, tuple[str, Table]] = {
    "ConstraintCritic": ("constraint_weight", _renamed(cost_power="constraint_power")),
    "CostCritic": (
        "cost_weight", _renamed(cost_power="cost_power", near_goal_distance="near_goal"),
    ),
    "ObstaclesCritic": (
        "", _renamed(cost_power="obstacles_power", near_goal_distance="near_goal"),
    ),
    "GoalCritic": (
        "goal_weight", _renamed(cost_power="goal_power", threshold_to_consider="goal_range"),
    ),
    "GoalAngleCritic": (
        "goal_angle_weight",
        _renamed(cost_power="goal_angle_power", threshold_to_consider="goal_angle_range"),
    ),
    "PathAlignCritic": (
        "path_align_weight",
        _renamed(cost_power="path_align_power", max_path_occupancy_ratio="path_align_occupied"),
    ),
    "PathAngleCritic": (
        "path_angle_weight",
        _renamed(cost_power="path_angle_power", max_angle_to_furthest="path_angle_least"),
    ),
    "PathFollowCritic": ("path_follow_weight", _renamed(cost_power="path_follow_power")),
    "PreferForwardCritic": ("prefer_forward_weight", _renamed(cost_power="prefer_forward_power")),
}  # fmt: skip
"""Critic -> the parameter for its `cost_weight` (0 when the critic is disabled), and the others."""

DWB: Table = {
    **_renamed(
        max_vel_x="cruise_speed",
        max_vel_theta="turn_speed",
        vx_samples="linear_samples",
        vtheta_samples="angular_samples",
        sim_time="simulation_time",
    ),
    "min_vel_x": Equivalent("reverse_speed", _opposite),
    # Map grids count cells, scaled by half the resolution: half the scale per metre.
    "PathDist.scale": _scaled("path_distance_weight", 0.5),
    "GoalDist.scale": _scaled("goal_distance_weight", 0.5),
    "PathAlign.scale": _scaled("path_align_weight", 0.5),
    "GoalAlign.scale": _scaled("goal_align_weight", 0.5),
    "PathAlign.forward_point_distance": Equivalent("forward_point"),
    # treepilot: fraction of 252, the highest cost below the inscribed one; Nav2: the cost itself.
    "BaseObstacle.scale": _scaled("obstacle_weight", 252.0),
    "Twirling.scale": Equivalent("twirling_weight"),
    "Oscillation.oscillation_reset_dist": Equivalent("oscillation_distance"),
    "Oscillation.oscillation_reset_angle": Equivalent("oscillation_angle"),
}

GRACEFUL: Table = {
    **_renamed(
        min_lookahead="min_lookahead",
        max_lookahead="max_lookahead",
        k_phi="k_phi",
        k_delta="k_delta",
        beta="beta",
        v_linear_min="min_speed",
        v_linear_max="cruise_speed",
        v_angular_max="turn_speed",
        initial_rotation="rotate_to_heading",
        initial_rotation_tolerance="rotate_angle",
    ),
    "lambda": Equivalent("slowing_power"),
}

CONTROLLERS: Mapping[str, tuple[str, Table]] = {
    "RegulatedPurePursuitController": ("pure_pursuit", PURE_PURSUIT),
    "MPPIController": ("mppi", MPPI),
    "DWBLocalPlanner": ("dwb", DWB),
    "GracefulController": ("graceful", GRACEFUL),
}
"""Nav2 class -> treepilot's controller and its parameters."""

SPEEDS: Table = _renamed(
    max_linear_vel="cruise_speed",
    desired_linear_vel="cruise_speed",
    max_vel_x="cruise_speed",
    vx_max="cruise_speed",
    v_linear_max="cruise_speed",
    max_linear_velocity="cruise_speed",
    max_velocity="cruise_speed",
    max_speed_xy="cruise_speed",
    max_vel_trans="cruise_speed",
    max_angular_vel="turn_speed",
    max_vel_theta="turn_speed",
    wz_max="turn_speed",
    v_angular_max="turn_speed",
    max_rot_vel="turn_speed",
    max_speed_theta="turn_speed",
    max_angular_velocity="turn_speed",
    rotate_to_heading_angular_vel="turn_speed",
)
"""Speed limits under the names that controllers without an equivalent give them."""

SHIM: Mapping[str, Table] = {
    "pure_pursuit": _renamed(
        angular_dist_threshold="turn_angle", rotate_to_heading_angular_vel="turn_speed"
    ),
    "": _renamed(
        angular_dist_threshold="rotate_angle",
        rotate_to_heading_angular_vel="rotate_speed",
        forward_sampling_distance="rotate_lookahead",
    ),
}
"""Parameters of the rotation shim, by treepilot's controller; "" is any other controller."""

_SMAC = {
    **_renamed(
        tolerance="tolerance",
        allow_unknown="allow_unknown",
        reverse_penalty="reverse_penalty",
        non_straight_penalty="non_straight_penalty",
        change_penalty="change_penalty",
        cost_penalty="cost_weight",
        analytic_expansion_ratio="analytic_ratio",
    ),
    "max_iterations": Equivalent("max_expansions", lambda v: v if v > 0 else None),
    "smooth_path": Equivalent("smoother", lambda v: None if v else "none"),
}

PLANNERS: Mapping[str, tuple[str, Table]] = {
    "NavfnPlanner": ("astar", _renamed(tolerance="tolerance", allow_unknown="allow_unknown")),
    "SmacPlanner2D": (
        "astar",
        _renamed(
            tolerance="tolerance", allow_unknown="allow_unknown",
            cost_travel_multiplier="cost_weight",
        ),
    ),
    "ThetaStarPlanner": (
        "theta_star",
        _renamed(
            allow_unknown="allow_unknown", w_euc_cost="euclidean_weight",
            w_traversal_cost="traversal_weight",
        ),
    ),
    "SmacPlannerHybrid": (
        "hybrid_astar",
        {
            **_SMAC,
            "minimum_turning_radius": Equivalent("turning_radius"),
            "motion_model_for_search": Equivalent(
                "motion", lambda v: "dubins" if str(v).upper() == "DUBIN" else "reeds_shepp"
            ),
        },
    ),
    "SmacPlannerLattice": (
        "lattice",
        {
            **_SMAC,
            "rotation_penalty": Equivalent("rotation_penalty"),
            "allow_reverse_expansion": Equivalent("allow_reverse"),
        },
    ),
}  # fmt: skip

SMOOTHERS = {
    "SimpleSmoother": "simple",
    "SavitzkyGolaySmoother": "savitzky_golay",
    "ConstrainedSmoother": "constrained",
}

_TOLERANCES = _renamed(xy_goal_tolerance="position", yaw_goal_tolerance="heading")
GOAL_CHECKERS: Mapping[str, tuple[str, Table]] = {
    "SimpleGoalChecker": ("simple_goal", _TOLERANCES),
    "StoppedGoalChecker": ("stopped_goal", _TOLERANCES),
}
_MOVEMENT = _renamed(required_movement_radius="distance", movement_time_allowance="time")
PROGRESS_CHECKERS: Mapping[str, tuple[str, Table]] = {
    "SimpleProgressChecker": ("simple_progress", _MOVEMENT),
    "PoseProgressChecker": (
        "pose_progress", {**_MOVEMENT, **_renamed(required_movement_angle="angle")}
    ),
}  # fmt: skip
SHARED: Mapping[str, Table] = {
    "planner": _renamed(tolerance="tolerance", allow_unknown="allow_unknown"),
    "goal_checker": _TOLERANCES,
    "progress_checker": _MOVEMENT,
}
"""Parameters of components without an equivalent that the default component has too."""

CONTROLLER_SERVER: Table = {
    "failure_tolerance": Equivalent("collision_patience", lambda v: v if v > 0.0 else None),
}
PLANNER_SERVER: Table = _renamed(allow_partial_planning="allow_partial")
BEHAVIOURS: Table = _renamed(max_rotational_vel="spin_speed")
COSTMAP: Table = _renamed(resolution="resolution")

LAYERS: Mapping[str, str] = {
    "StaticLayer": "static",
    "ObstacleLayer": SENSORS,
    "VoxelLayer": SENSORS,
    "RangeSensorLayer": SENSORS,
    "DenoiseLayer": "denoise",
    "InflationLayer": "",
    "KeepoutFilter": "",
    "SpeedFilter": "",
    "BinaryFilter": "",
}
"""Class -> layer; empty: none, as the costmap itself inflates, and zones are the mission's."""

FILTERS = {
    "KeepoutFilter": "write `costmap: {layers: [static, sensors, {use: keepout, mask: map.yaml}]}`",
    "SpeedFilter": "write `speed_limits: {mask: map.yaml}`",
    "BinaryFilter": "",
}
"""Classes that read a mask -> what to write instead."""

USUAL_PLUGINS = {
    "static_layer": "StaticLayer",
    "obstacle_layer": "ObstacleLayer",
    "inflation_layer": "InflationLayer",
}
"""Layers that Nav2 has unless `plugins` lists others, by name."""

DENOISE: Table = _renamed(minimal_group_size="smallest_group")
INFLATION: Table = _renamed(inflation_radius="inflation_radius", cost_scaling_factor="cost_scaling")
SCAN_SOURCE: Table = _renamed(
    obstacle_max_range="obstacle_range",
    obstacle_range="obstacle_range",
    raytrace_max_range="clearing_range",
    raytrace_range="clearing_range",
    observation_persistence="persistence",
)
"""The names without `max` are those of Foxy."""

VELOCITY_LISTS: Mapping[str, tuple[tuple[int, Equivalent], ...]] = {
    "max_velocity": ((0, Equivalent("top_speed")),),
    "deadband_velocity": ((0, Equivalent("dead_band")), (2, Equivalent("turning_dead_band"))),
}
"""Lists [x, y, theta] of the velocity smoother: index of an item and its equivalent."""

ZONE: Table = {
    **_renamed(
        radius="radius", min_points="points", slowdown_ratio="ratio", linear_limit="linear",
        angular_limit="angular", time_before_collision="time",
    ),
    "max_points": Equivalent("points", lambda v: v + 1),
    "linear_min": Equivalent("speed_from"),
    "linear_max": Equivalent("speed_to"),
}  # fmt: skip
ZONE_ACTIONS = {
    "stop": "stop", "slowdown": "slow_down", "limit": "limit", "approach": "approach",
}  # fmt: skip
