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
    new = NAMES.get((found[2], found[1])) if found else None
    return f"; it was renamed to {new}" if new else ""
