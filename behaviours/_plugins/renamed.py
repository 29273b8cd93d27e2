"""Names that plugins imported in earlier versions, and their new names (CHANGELOG.md)."""

from __future__ import annotations

import re

MODULES = {
    "stack.description": "stack.drivetrain.description",
    "stack.kinematics": "stack.drivetrain.kinematics",
    "stack.findings": "stack.documents",
    "stack.control.track": "stack.geometry.path_segment",
    "stack.control.path_progress": "stack.geometry.path_segment",
    "stack.control.ends": "stack.control.goal_alignment",
    "stack.control.legs": "stack.control.path_follower",
    "stack.control.cusp_splitter": "stack.control.path_follower",
    "stack.costmap.footprint": "stack.geometry.polygons",
    "stack.costmap.painting": "stack.costmap.layer_compositor",
    "stack.costmap.inflation_layer": "stack.costmap.inflation",
    "behaviours.approach_object": "behaviours.perception.approach_object",
    "behaviours.assisted_teleop": "behaviours.motion.assisted_teleop",
    "behaviours.back_up": "behaviours.motion.back_up",
    "behaviours.check": "behaviours.flow.check",
    "behaviours.clear_costmap": "behaviours.navigation.clear_costmap",
    "behaviours.clear_costmap_around_robot": "behaviours.navigation.clear_costmap_around_robot",
    "behaviours.compute_path": "behaviours.navigation.compute_path",
    "behaviours.coverage": "behaviours.navigation.coverage",
    "behaviours.detect_markers": "behaviours.perception.detect_markers",
    "behaviours.disambiguate": "behaviours.localisation.disambiguate",
    "behaviours.dock": "behaviours.docking.dock",
    "behaviours.drive_for": "behaviours.motion.drive_for",
    "behaviours.drive_on_heading": "behaviours.motion.drive_on_heading",
    "behaviours.explore": "behaviours.mapping.explore",
    "behaviours.fail": "behaviours.flow.fail",
    "behaviours.find_object": "behaviours.perception.find_object",
    "behaviours.follow_line": "behaviours.following.follow_line",
    "behaviours.follow_path": "behaviours.navigation.follow_path",
    "behaviours.follow_person": "behaviours.following.follow_person",
    "behaviours.free_space_escape": "behaviours.motion.free_space_escape",
    "behaviours.inspect": "behaviours.perception.inspect",
    "behaviours.load_map": "behaviours.mapping.load_map",
    "behaviours.localise_globally": "behaviours.localisation.localise_globally",
    "behaviours.navigate_through": "behaviours.navigation.navigate_through",
    "behaviours.navigate_to_pose": "behaviours.navigation.navigate_to_pose",
    "behaviours.relocalise": "behaviours.localisation.relocalise",
    "behaviours.save_map": "behaviours.mapping.save_map",
    "behaviours.say": "behaviours.flow.say",
    "behaviours.set": "behaviours.flow.set",
    "behaviours.set_edge": "behaviours.navigation.set_edge",
    "behaviours.set_mapping": "behaviours.mapping.set_mapping",
    "behaviours.set_pose": "behaviours.localisation.set_pose",
    "behaviours.spin": "behaviours.motion.spin",
    "behaviours.take_photo": "behaviours.perception.take_photo",
    "behaviours.undock": "behaviours.docking.undock",
    "behaviours.wait": "behaviours.flow.wait",
    "behaviours.wait_for_door": "behaviours.perception.wait_for_door",
    "behaviours.wait_until": "behaviours.flow.wait_until",
    "behaviours.wall_follow": "behaviours.following.wall_follow",
}

NAMES = {
    ("stack.types", "Track"): "TrackedObject",
    ("stack.components", "Terms"): "PlanOptions",
    ("stack.components", "Stop"): "CancelToken",
    ("stack.costmap.layer", "Senses"): "LayerUpdate",
    ("stack.costmap.layer", "SensorUpdate"): "LayerUpdate",
    ("stack.costmap.layer", "CostmapLayer"): "Layer",
    ("stack.costmap.layer", "CellOrigin"): "CellProvenance",
}

_NAME = re.compile(r"cannot import name '(\w+)' from '([\w.]+)'")


def hint_for(error: ImportError) -> str:
    """Return `; X was renamed to Y` for a failed import of an old name, else an empty text."""
    if isinstance(error, ModuleNotFoundError):
        new = MODULES.get(error.name or "")
        return f"; it was renamed to {new}" if new else ""
    found = _NAME.search(str(error))
    if found is None:
        return ""
    name, module = found.groups()
    new = NAMES.get((module, name)) or MODULES.get(f"{module}.{name}")
    return f"; it was renamed to {new}" if new else ""
