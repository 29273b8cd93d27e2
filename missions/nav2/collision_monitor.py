"""Import of the zones of Nav2's collision monitor."""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import isfinite
from typing import Any

from missions.nav2 import equivalents as tables
from missions.nav2.equivalents import Equivalent
from missions.nav2.importer import REPLACED, ComponentValues, Importer, Section
from stack.parameters import declarations
from stack.safety.zones import SafetyZone


def read_zones(importer: Importer) -> None:
    """Import the collision monitor."""
    server = importer.server("collision_monitor")
    if server is None:
        return
    timeout = Equivalent("stale_after", lambda seconds: seconds if seconds > 0.0 else None)
    importer.copy(server, "safety", {"source_timeout": timeout})
    sections = [server.get(name) for name in server.texts("polygons")]
    zones = [zone for section in sections if section is not None and section.is_enabled
             for zone in _zones(importer, section)]  # fmt: skip
    if zones:
        values = importer.kinds.setdefault("safety", ComponentValues())
        values.values["zones"] = zones
        values.marks["zones"] = server.node.mark


def _zones(importer: Importer, section: Section) -> Iterator[dict[str, Any]]:
    action = section.get("action_type")
    word = "" if action is None else str(action.node.value)
    if action is None or word == "none":
        return
    if word not in tables.ZONE_ACTIONS:
        importer.warn(REPLACED, action, f"there is no action {word!r}; the zone is not imported")
        return
    ours = tables.ZONE_ACTIONS[word]
    importer.record(action, "safety", "zones.action", ours)
    zone = {"name": section.path.rpartition(".")[2], "action": ours, **_values(importer, section)}
    parts = [section.get(name) for name in section.texts("velocity_polygons")]
    if not parts:
        yield zone
    for part in parts:
        if part is not None:
            name = f"{zone['name']} {part.path.rpartition('.')[2]}"
            yield {**zone, **_values(importer, part), "name": name}


def _values(importer: Importer, section: Section) -> dict[str, Any]:
    """Return the parameters and the outline of a zone."""
    values = importer.copied(section, "safety.zones", tables.ZONE, declarations(SafetyZone))
    kind = section.get("type")
    is_circle = kind is not None and kind.node.value == "circle"
    corners = section.get("points")
    if is_circle:
        return values
    values.pop("radius", None)
    outline = None if corners is None else importer.converted(corners, _corners)
    if corners is not None and outline is not None:
        values["corners"] = outline
        importer.record(corners, "safety", "zones.corners", outline)
    topic = section.get("polygon_sub_topic")
    if corners is None and topic is not None:
        importer.warn(REPLACED, topic, "its corners come from a topic; the footprint is the zone")
    return values


def _corners(raw: Any) -> list[list[float]] | None:
    """Parse `"[[0.3, 0.2], …]"`, or `[0.3, 0.2, …]` of older files; metres, base frame.

    Raises:
        ValueError: it is not a polygon.
    """
    corners = json.loads(raw) if isinstance(raw, str) and raw.strip() else raw
    if not corners:
        return None
    if not isinstance(corners[0], list):
        corners = [corners[at : at + 2] for at in range(0, len(corners), 2)]
    polygon = [[float(x), float(y)] for x, y in corners]
    if len(polygon) < 3 or not all(isfinite(number) for corner in polygon for number in corner):
        raise ValueError("not a polygon")
    return polygon
