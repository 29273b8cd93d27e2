"""Read a `nav2_params.yaml` and import the parameters that have an equivalent."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missions.nav2 import equivalents as tables
from missions.nav2.equivalents import Equivalent
from missions.nav2.sheet import (
    CODE,
    ComponentValues,
    Ignored,
    Imported,
    Importer,
    Section,
    class_name,
)
from stack.documents import Finding, Findings, read_document, require_kind
from stack.documents.file_kinds import NAV2
from stack.errors import InputError


@dataclass(frozen=True)
class Nav2Settings:
    """Settings imported from a Nav2 parameter file.

    Attributes:
        kinds: planner, controller, costmap, navigator, safety -> their imported settings.
        imported: imported parameters, in the order of the import.
        ignored: parameters without an equivalent, in the order of the file.
    """

    kinds: Mapping[str, ComponentValues]
    imported: tuple[Imported, ...]
    ignored: tuple[Ignored, ...]


def read_nav2(path: Path, text: str | None = None) -> Nav2Settings:
    """Read a Nav2 parameter file.

    Raises:
        InputError: the file cannot be read, is not a Nav2 parameter file, or has invalid values.
    """
    top = require_kind(read_document(path, NAV2, text), NAV2)
    findings = Findings()
    importer = Importer(top, findings)
    if not importer.servers:
        sentence = "not a Nav2 parameter file: no node has `ros__parameters`"
        raise InputError([Finding(top.mark, CODE, sentence)])
    _controller_server(importer)
    _planner_server(importer)
    _costmaps(importer)
    importer.copy(importer.server("behavior_server"), "navigator", tables.BEHAVIOURS)
    _velocity_smoother(importer)
    _collision_monitor(importer)
    findings.raise_errors()
    return Nav2Settings(importer.kinds, tuple(importer.imported), tuple(importer.ignored()))


def _first(server: Section, plural: str) -> Section | None:
    """Return the section of the first listed plugin; older files use the singular key."""
    names = server.texts(plural) or server.texts(plural.removesuffix("s"))
    return server.get(names[0]) if names else None


def _controller_server(importer: Importer) -> None:
    server = importer.server("controller_server")
    if server is None:
        return
    importer.copy(server, "navigator", tables.CONTROLLER_SERVER)
    _checker(importer, server, "goal_checker", tables.GOAL_CHECKERS)
    _checker(importer, server, "progress_checker", tables.PROGRESS_CHECKERS)
    section = _first(server, "controller_plugins")
    if section is not None:
        _controller(importer, section)


def _checker(
    importer: Importer, server: Section, kind: str, known: Mapping[str, tuple[str, tables.Table]]
) -> None:
    """Import the first goal or progress checker."""
    section = _first(server, f"{kind}_plugins")
    if section is None or section.plugin not in known:
        return
    ours, table = known[section.plugin]
    importer.use(kind, section, ours)
    importer.copy(section, kind, table)


def _controller(importer: Importer, section: Section) -> None:
    shim = section.plugin == "RotationShimController"
    named = section.get("primary_controller")
    word = class_name(named.node.value) if shim and named is not None else section.plugin
    if word not in tables.CONTROLLERS:
        return
    ours, table = tables.CONTROLLERS[word]
    importer.use("controller", named if shim and named is not None else section, ours)
    importer.copy(section, "controller", table)
    if shim:
        importer.copy(section, "controller", tables.SHIM.get(ours, tables.SHIM[""]))
    if ours == "pure_pursuit":
        _lookahead(importer, section)
    if ours == "mppi":
        _critics(importer, section)


def _lookahead(importer: Importer, section: Section) -> None:
    """Set minimum and maximum lookahead equal if the lookahead is not scaled with velocity."""
    scaled, fixed = section.get("use_velocity_scaled_lookahead_dist"), section.get("lookahead_dist")
    if fixed is not None and (scaled is None or scaled.node.value is False):
        for name in ("min_lookahead", "max_lookahead"):
            importer.set("controller", fixed, Equivalent(name))


def _critics(importer: Importer, section: Section) -> None:
    """Import the weights of the critics; critics not listed or disabled get the weight 0."""
    listed = section.texts("critics")
    for name, (weight, table) in tables.MPPI_CRITICS.items():
        critic = section.get(name)
        enabled = critic.get("enabled") if critic is not None else None
        off = enabled is not None and enabled.node.value is False
        if weight and (off or (listed and name not in listed)):
            source = enabled if off and enabled is not None else section.get("critics") or section
            importer.set("controller", source, Equivalent(weight, lambda _: 0.0))
            continue
        importer.copy(critic, "controller", table)
        if weight:
            importer.copy(critic, "controller", {"cost_weight": Equivalent(weight)})


def _planner_server(importer: Importer) -> None:
    server = importer.server("planner_server")
    section = _first(server, "planner_plugins") if server is not None else None
    if section is None or section.plugin not in tables.PLANNERS:
        return
    ours, table = tables.PLANNERS[section.plugin]
    importer.use("planner", section, ours)
    importer.copy(section, "planner", table)
    importer.copy(server, "planner", tables.PLANNER_SERVER)
    smoothers = importer.server("smoother_server")
    smoother = _first(smoothers, "smoother_plugins") if smoothers is not None else None
    plugin = smoother.get("plugin") if smoother is not None else None
    if smoother is not None and plugin is not None and smoother.plugin in tables.SMOOTHERS:
        name = tables.SMOOTHERS[smoother.plugin]
        importer.set("planner", plugin, Equivalent("smoother", lambda _: name))


def _costmaps(importer: Importer) -> None:
    importer.copy(importer.server("local_costmap"), "costmap", tables.COSTMAP)
    both: list[dict[str, Any]] = []
    for which in ("global", "local"):
        server = importer.server(f"{which}_costmap")
        if server is None:
            return  # importing one costmap only would remove the layers of the other
        both += [{**layer, "only": which} for layer in _layers(importer, server)]
    _inflation(importer)
    layers = _merged(both)
    if layers:
        values = importer.kinds.setdefault("costmap", ComponentValues())
        values.values["layers"] = layers
        values.marks["layers"] = importer.servers["local_costmap"].node.mark


def _layers(importer: Importer, server: Section) -> list[dict[str, Any]]:
    """Return the layers of a costmap that have an equivalent."""
    found = []
    for section in _enabled(server):
        if section.plugin not in tables.LAYERS:
            continue
        use, table = tables.LAYERS[section.plugin]
        plugin = section.get("plugin")
        if plugin is not None:
            importer.record(plugin, "costmap", "layers", use)
        layer = {"use": use, **_layer_values(importer, section, table)}
        for source in section.texts("observation_sources")[:1]:
            layer.update(_layer_values(importer, section.get(source), tables.SCAN_SOURCE))
        found.append(layer)
    return found


def _enabled(server: Section) -> list[Section]:
    """Return the sections of a costmap's plugins that are not disabled."""
    sections = [server.get(name) for name in server.texts("plugins")]
    switches = [None if section is None else section.get("enabled") for section in sections]
    return [
        section
        for section, switch in zip(sections, switches, strict=True)
        if section is not None and (switch is None or switch.node.value is not False)
    ]


def _inflation(importer: Importer) -> None:
    """Import the inflation of both costmaps; where they differ, the local one has its own values.

    A costmap without an inflation layer gets the radius 0.
    """
    for server, prefix in ((importer.server("global_costmap"), ""),
                           (importer.server("local_costmap"), "local_")):  # fmt: skip
        plugins = None if server is None else server.get("plugins")
        if server is None or plugins is None:
            continue
        layer = next((item for item in _enabled(server) if item.plugin == "InflationLayer"), None)
        if layer is None:
            none = Equivalent("inflation_radius", lambda _: 0.0)
            _set_inflation(importer, plugins, none, prefix)
            continue
        plugin = layer.get("plugin")
        if plugin is not None:
            importer.record(plugin, "costmap", "inflation", "always")
        for key, equivalent in tables.INFLATION.items():
            part = layer.get(key)
            if part is not None:
                _set_inflation(importer, part, equivalent, prefix)


def _set_inflation(importer: Importer, part: Section, equivalent: Equivalent, prefix: str) -> None:
    both = importer.kinds.setdefault("costmap", ComponentValues()).values.get(equivalent.name)
    value = importer.converted(part, equivalent.convert)
    if prefix and value == both:
        importer.record(part, "costmap", equivalent.name, value)
    else:
        importer.set("costmap", part, Equivalent(prefix + equivalent.name, equivalent.convert))


def _layer_values(
    importer: Importer, section: Section | None, table: tables.Table
) -> dict[str, Any]:
    values = {}
    for key, equivalent in table.items() if section is not None else ():
        part = section.get(key) if section is not None else None
        value = None if part is None else importer.converted(part, equivalent.convert)
        if part is not None and value is not None:
            values[equivalent.name] = value
            importer.record(part, "costmap", f"layers.{equivalent.name}", value)
    return values


def _merged(layers: list[dict[str, Any]]) -> list[Any]:
    """Return each layer once: shared by both costmaps, or named after its costmap."""
    merged: list[Any] = []
    for layer in layers:
        equal = next((m for m in merged if {**m, "only": ""} == {**layer, "only": ""}), None)
        if equal is not None:
            equal["only"] = "both"
            continue
        merged.append(dict(layer))
    names = [layer["use"] for layer in merged]
    for layer in merged:
        if names.count(layer["use"]) > 1:
            layer["name"] = f"{layer['only']}_{layer['use']}"
    return merged


def _velocity_smoother(importer: Importer) -> None:
    server = importer.server("velocity_smoother")
    if server is None:
        return
    for key, items in tables.VELOCITY_LISTS.items():
        found = server.get(key)
        if found is None:
            continue
        importer.mark_seen(found)
        for at, equivalent in items:
            if len(found.node.items) > at:
                item = found.node.items[at]
                importer.set("safety", Section(f"{found.path}[{at}]", item), equivalent)
    feedback = server.get("feedback")
    if feedback is not None:
        closed = Equivalent("closed_loop", lambda word: str(word).upper() == "CLOSED_LOOP")
        importer.set("safety", feedback, closed)


def _collision_monitor(importer: Importer) -> None:
    server = importer.server("collision_monitor")
    if server is None:
        return
    timeout = Equivalent("stale_after", lambda seconds: seconds if seconds > 0.0 else None)
    importer.copy(server, "safety", {"source_timeout": timeout})
    sections = [server.get(name) for name in server.texts("polygons")]
    zones = [_zone(importer, section) for section in sections if section is not None]
    found = [zone for zone in zones if zone is not None]
    if found:
        values = importer.kinds.setdefault("safety", ComponentValues())
        values.values["zones"] = found
        values.marks["zones"] = server.node.mark


def _zone(importer: Importer, section: Section) -> dict[str, Any] | None:
    action = section.get("action_type")
    enabled = section.get("enabled")
    if action is None or (enabled is not None and enabled.node.value is False):
        return None
    word = str(action.node.value)
    if word not in tables.ZONE_ACTIONS:
        return None
    zone: dict[str, Any] = {
        "name": section.path.rpartition(".")[2], "action": tables.ZONE_ACTIONS[word],
    }  # fmt: skip
    importer.record(action, "safety", "zones.action", zone["action"])
    for key, equivalent in tables.ZONE.items():
        part = section.get(key)
        value = None if part is None else importer.converted(part, equivalent.convert)
        if part is not None and value is not None:
            zone[equivalent.name] = value
            importer.record(part, "safety", f"zones.{equivalent.name}", value)
    corners = section.get("points")
    if corners is not None:
        zone["corners"] = importer.converted(corners, _corners)
        importer.record(corners, "safety", "zones.corners", zone["corners"])
    return zone


def _corners(raw: Any) -> list[list[float]]:
    """Parse `"[[0.3, 0.2], …]"`, or `[0.3, 0.2, …]` of older files; metres, base frame."""
    corners = json.loads(raw) if isinstance(raw, str) else raw
    if corners and not isinstance(corners[0], list):
        corners = [corners[at : at + 2] for at in range(0, len(corners), 2)]
    return [[float(x), float(y)] for x, y in corners]
