"""Why a parameter of Nav2 has no equivalent, in a sentence."""

from __future__ import annotations

from fnmatch import fnmatchcase

NO_EQUIVALENT = "no equivalent"
STRUCTURE = "says what belongs together"

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
    ("*_timeout", "parts call each other; nothing times out in between"),
    ("*bond_heartbeat*", "there are no nodes to keep alive"),
    ("amcl.*", "localisation tunes itself; a mission sets `initial_pose`"),
    ("slam_toolbox.*", "not imported; see `map` in docs/language.md"),
    ("bt_navigator*", "a mission is the behaviour tree; see docs/language.md"),
    ("lifecycle_manager*", "parts start in turn, in one process"),
    ("map_server.*", "a mission's `map` or `world` brings the map"),
    ("map_saver*", "a mission's `map` or `world` brings the map"),
    ("waypoint_follower.*", "waypoints and their tasks stand in the mission"),
    ("docking_server.*", "docking is a behaviour of the mission"),
    ("*costmap.robot_radius", "the footprint in robot.yaml holds"),
    ("*costmap.footprint*", "the footprint in robot.yaml holds"),
    ("*costmap.*frequency", "rates are the run's; see docs/architecture.md"),
    ("*_frequency", "rates are the run's; see docs/architecture.md"),
    ("*costmap.rolling_window", "the local costmap rolls, the global one covers the map"),
    ("*costmap.width", "the local costmap's window is fixed"),
    ("*costmap.height", "the local costmap's window is fixed"),
    ("global_costmap.*resolution", "the global costmap has the map's resolution"),
    ("*costmap.track_unknown_space", "unknown ground is always told from free ground"),
    ("*acc_lim*", "the limits in robot.yaml hold"),
    ("*decel_lim*", "the limits in robot.yaml hold"),
    ("*_accel", "the limits in robot.yaml hold"),
    ("*_decel", "the limits in robot.yaml hold"),
    ("*.motion_model", "the drive in robot.yaml holds"),
    ("*ObstaclesCritic.*", "weights are in another unit; the default holds"),
    ("*.critics", STRUCTURE),
    ("*plugins", STRUCTURE),
    ("*_plugin", STRUCTURE),
    ("*.enabled", STRUCTURE),
    ("*.observation_sources", STRUCTURE),
    ("*checker.plugin", STRUCTURE),
    ("collision_monitor.polygons", STRUCTURE),
    ("collision_monitor.*.type", STRUCTURE),
    ("*.plugin", "no such component here"),
    ("*visualize*", "nothing is published; see the dashboard and rerun"),
    ("*publish*", "nothing is published; see the dashboard and rerun"),
)


def reason(path: str) -> str:
    """Why `controller_server.FollowPath.critics` and the like are not taken over."""
    return next((why for pattern, why in _REASONS if fnmatchcase(path, pattern)), NO_EQUIVALENT)
