"""Reasons why a Nav2 parameter is ignored."""

from __future__ import annotations

from fnmatch import fnmatchcase

NO_EQUIVALENT = "no equivalent"
STRUCTURE = "structure of the file"

_REASONS = (
    ("*.use_sim_time", "there is one clock, the robot's"),
    ("*.robot_base_frame", "frames are fixed: map, odom, base"),
    ("*.base_frame*", "frames are fixed: map, odom, base"),
    ("*.global_frame*", "frames are fixed: map, odom, base"),
    ("*.local_frame", "frames are fixed: map, odom, base"),
    ("*.odom_frame*", "frames are fixed: map, odom, base"),
    ("*transform_tolerance", "there are no transforms to wait for"),
    ("*_topic", "there are no topics"),
    ("*.topic", "there are no topics"),
    ("*_timeout", "there are no calls between nodes that could time out"),
    ("*bond_heartbeat*", "there are no nodes to keep alive"),
    ("amcl.*", "not imported; see `localisation` and `treepilot describe mcl`"),
    ("slam_toolbox.*", "not imported; see `map` in docs/reference.md"),
    ("*.bt_loop_duration", "not imported; see `navigation: {loop: {tree_rate: …}}`"),
    ("bt_navigator*", "a mission is the behaviour tree; see docs/language.md"),
    ("lifecycle_manager*", "there are no lifecycle nodes"),
    ("map_server.*", "the mission's `map` or `world` provides the map"),
    ("map_saver*", "the mission's `map` or `world` provides the map"),
    ("waypoint_follower.*", "waypoints and their tasks are part of the mission"),
    ("docking_server.*", "docking is a behaviour of the mission"),
    ("*costmap.robot_radius", "the footprint in robot.yaml is used"),
    ("*costmap.footprint*", "the footprint in robot.yaml is used"),
    ("*costmap.*frequency", "costmaps are updated with every measurement"),
    ("*.controller_frequency", "not imported; see `navigation: {loop: {control_rate: …}}`"),
    ("*_frequency", "rates are those of the step loop; see `navigation: {loop: …}`"),
    ("*costmap.rolling_window", "the local costmap rolls, the global one covers the map"),
    ("*costmap.width", "not imported; see `costmap: {local_size: …}`"),
    ("*costmap.height", "not imported; see `costmap: {local_size: …}`"),
    ("global_costmap.*resolution", "the global costmap has the resolution of the map"),
    ("*costmap.track_unknown_space", "unknown space is always tracked"),
    ("*acc_lim*", "the limits in robot.yaml are used"),
    ("*decel_lim*", "the limits in robot.yaml are used"),
    ("*_accel", "the limits in robot.yaml are used"),
    ("*_decel", "the limits in robot.yaml are used"),
    ("*.motion_model", "the drive in robot.yaml is used"),
    ("*ObstaclesCritic.*", "the weight has another unit; the default is used"),
    ("*.vy_std", "0 has no effect; `vy_max: 0.0` turns sideways motion off"),
    ("*.critics", STRUCTURE),
    ("*plugins", STRUCTURE),
    ("*_plugin", STRUCTURE),
    ("*.enabled", STRUCTURE),
    ("*.observation_sources", STRUCTURE),
    ("*checker.plugin", STRUCTURE),
    ("collision_monitor.polygons", STRUCTURE),
    ("collision_monitor.*.type", STRUCTURE),
    ("*.plugin", "no equivalent component"),
    ("*visualize*", "there are no topics; see the dashboard and rerun"),
    ("*publish*", "there are no topics; see the dashboard and rerun"),
)


def reason(path: str) -> str:
    """Return why a parameter such as `controller_server.FollowPath.critics` is ignored."""
    return next((why for pattern, why in _REASONS if fnmatchcase(path, pattern)), NO_EQUIVALENT)
