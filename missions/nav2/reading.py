"""Reads a `nav2_params.yaml` and says what of it treepilot takes over."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missions.nav2 import equivalents as tables
from missions.nav2.equivalents import Equivalent
from missions.nav2.sheet import CODE, Left, Part, Sheet, Taken, Values, class_name
from stack.documents import Finding, Findings, read_document
from stack.errors import InputError


@dataclass(frozen=True)
class Nav2Settings:
    """What a parameter file of Nav2 comes to.

    Attributes:
        kinds: planner, controller, costmap, navigator, safety: what the file says of them.
        taken: parameters taken over, in the order in which they were understood.
        left: parameters without an equivalent, in the order of the file.
    """

    kinds: Mapping[str, Values]
    taken: tuple[Taken, ...]
    left: tuple[Left, ...]


def read_nav2(path: Path, text: str | None = None) -> Nav2Settings:
    """Read a parameter file of Nav2.

    Raises:
        InputError: not readable, not such a file, or with values that cannot be meant.
    """
    top = read_document(path, "Nav2 parameter file", text)
    findings = Findings()
    sheet = Sheet(top, findings)
    if not sheet.servers:
        sentence = "not a parameter file of Nav2: nothing has `ros__parameters`"
        raise InputError([Finding(top.mark, CODE, sentence)])
    _controller_server(sheet)
    _planner_server(sheet)
    _costmaps(sheet)
    sheet.take(sheet.server("behavior_server"), "navigator", tables.BEHAVIOURS)
    _velocity_smoother(sheet)
    _collision_monitor(sheet)
    findings.raise_errors()
    return Nav2Settings(sheet.kinds, tuple(sheet.taken), tuple(sheet.left()))


def _first(server: Part, plural: str) -> Part | None:
    """The section of the first plugin that a server lists; older files list it in the singular."""
    names = server.texts(plural) or server.texts(plural.removesuffix("s"))
    return server.get(names[0]) if names else None


def _controller_server(sheet: Sheet) -> None:
    server = sheet.server("controller_server")
    if server is None:
        return
    sheet.take(server, "navigator", tables.CONTROLLER_SERVER)
    sheet.take(_first(server, "goal_checker_plugins"), "navigator", tables.GOAL_CHECKER)
    sheet.take(_first(server, "progress_checker_plugins"), "navigator", tables.PROGRESS_CHECKER)
    section = _first(server, "controller_plugins")
    if section is not None:
        _controller(sheet, section)


def _controller(sheet: Sheet, section: Part) -> None:
    shim = section.plugin == "RotationShimController"
    named = section.get("primary_controller")
    word = class_name(named.node.value) if shim and named is not None else section.plugin
    if word not in tables.CONTROLLERS:
        return
    ours, table = tables.CONTROLLERS[word]
    sheet.use("controller", named if shim and named is not None else section, ours)
    sheet.take(section, "controller", table)
    if shim:
        sheet.take(section, "controller", tables.SHIM.get(ours, tables.SHIM[""]))
    if ours == "pure_pursuit":
        _lookahead(sheet, section)
    if ours == "mppi":
        _critics(sheet, section)


def _lookahead(sheet: Sheet, section: Part) -> None:
    """A lookahead that does not change with the speed is as long at least as it is at most."""
    scaled, fixed = section.get("use_velocity_scaled_lookahead_dist"), section.get("lookahead_dist")
    if fixed is not None and (scaled is None or scaled.node.value is False):
        for name in ("min_lookahead", "max_lookahead"):
            sheet.set("controller", fixed, Equivalent(name))


def _critics(sheet: Sheet, section: Part) -> None:
    """Weights by critic; those that are not listed, or switched off, weigh nothing."""
    listed = section.texts("critics")
    for name, (weight, table) in tables.MPPI_CRITICS.items():
        critic = section.get(name)
        enabled = critic.get("enabled") if critic is not None else None
        off = enabled is not None and enabled.node.value is False
        if weight and (off or (listed and name not in listed)):
            source = enabled if off and enabled is not None else section.get("critics") or section
            sheet.set("controller", source, Equivalent(weight, lambda _: 0.0))
            continue
        sheet.take(critic, "controller", table)
        if weight:
            sheet.take(critic, "controller", {"cost_weight": Equivalent(weight)})


def _planner_server(sheet: Sheet) -> None:
    server = sheet.server("planner_server")
    section = _first(server, "planner_plugins") if server is not None else None
    if section is None or section.plugin not in tables.PLANNERS:
        return
    ours, table = tables.PLANNERS[section.plugin]
    sheet.use("planner", section, ours)
    sheet.take(section, "planner", table)
    sheet.take(server, "planner", tables.PLANNER_SERVER)
    smoothers = sheet.server("smoother_server")
    smoother = _first(smoothers, "smoother_plugins") if smoothers is not None else None
    plugin = smoother.get("plugin") if smoother is not None else None
    if smoother is not None and plugin is not None and smoother.plugin in tables.SMOOTHERS:
        name = tables.SMOOTHERS[smoother.plugin]
        sheet.set("planner", plugin, Equivalent("smoother", lambda _: name))


def _costmaps(sheet: Sheet) -> None:
    sheet.take(sheet.server("local_costmap"), "costmap", tables.COSTMAP)
    both: list[dict[str, Any]] = []
    for which in ("global", "local"):
        server = sheet.server(f"{which}_costmap")
        if server is None:
            return  # half a description would take away the other's layers
        both += [{**layer, "only": which} for layer in _layers(sheet, server)]
    layers = _merged(both)
    if layers:
        values = sheet.kinds.setdefault("costmap", Values())
        values.values["layers"] = layers
        values.marks["layers"] = sheet.servers["local_costmap"].node.mark


def _layers(sheet: Sheet, server: Part) -> list[dict[str, Any]]:
    """The layers of a costmap that have an equivalent, inflation last."""
    found = []
    for name in server.texts("plugins"):
        section = server.get(name)
        if section is None or section.plugin not in tables.LAYERS:
            continue
        enabled = section.get("enabled")
        if enabled is not None and enabled.node.value is False:
            continue
        use, table = tables.LAYERS[section.plugin]
        plugin = section.get("plugin")
        if plugin is not None:
            sheet.note(plugin, "costmap", "layers", use)
        layer = {"use": use, **_layer_values(sheet, section, table)}
        for source in section.texts("observation_sources")[:1]:
            layer.update(_layer_values(sheet, section.get(source), tables.SCAN_SOURCE))
        found.append(layer)
    return sorted(found, key=lambda layer: layer["use"] == "inflation")


def _layer_values(sheet: Sheet, section: Part | None, table: tables.Table) -> dict[str, Any]:
    values = {}
    for key, equivalent in table.items() if section is not None else ():
        part = section.get(key) if section is not None else None
        value = None if part is None else sheet.converted(part, equivalent.convert)
        if part is not None and value is not None:
            values[equivalent.name] = value
            sheet.note(part, "costmap", f"layers.{equivalent.name}", value)
    return values


def _merged(layers: list[dict[str, Any]]) -> list[Any]:
    """Layers that the costmaps have in common once, the others with a name of their own."""
    merged: list[Any] = []
    for layer in layers:
        twin = next((m for m in merged if {**m, "only": ""} == {**layer, "only": ""}), None)
        if twin is not None:
            twin["only"] = "both"
            continue
        merged.append(dict(layer))
    names = [layer["use"] for layer in merged]
    for layer in merged:
        if names.count(layer["use"]) > 1:
            layer["name"] = f"{layer['only']}_{layer['use']}"
    return sorted(merged, key=lambda layer: layer["use"] == "inflation")


def _velocity_smoother(sheet: Sheet) -> None:
    server = sheet.server("velocity_smoother")
    if server is None:
        return
    for key, items in tables.VELOCITY_LISTS.items():
        found = server.get(key)
        if found is None:
            continue
        sheet.seen(found)
        for at, equivalent in items:
            if len(found.node.items) > at:
                item = found.node.items[at]
                sheet.set("safety", Part(f"{found.path}[{at}]", item), equivalent)
    feedback = server.get("feedback")
    if feedback is not None:
        closed = Equivalent("closed_loop", lambda word: str(word).upper() == "CLOSED_LOOP")
        sheet.set("safety", feedback, closed)


def _collision_monitor(sheet: Sheet) -> None:
    server = sheet.server("collision_monitor")
    if server is None:
        return
    timeout = Equivalent("stale_after", lambda seconds: seconds if seconds > 0.0 else None)
    sheet.take(server, "safety", {"source_timeout": timeout})
    sections = [server.get(name) for name in server.texts("polygons")]
    zones = [_zone(sheet, section) for section in sections if section is not None]
    found = [zone for zone in zones if zone is not None]
    if found:
        values = sheet.kinds.setdefault("safety", Values())
        values.values["zones"] = found
        values.marks["zones"] = server.node.mark


def _zone(sheet: Sheet, section: Part) -> dict[str, Any] | None:
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
    sheet.note(action, "safety", "zones.action", zone["action"])
    for key, equivalent in tables.ZONE.items():
        part = section.get(key)
        value = None if part is None else sheet.converted(part, equivalent.convert)
        if part is not None and value is not None:
            zone[equivalent.name] = value
            sheet.note(part, "safety", f"zones.{equivalent.name}", value)
    corners = section.get("points")
    if corners is not None:
        zone["corners"] = sheet.converted(corners, _corners)
        sheet.note(corners, "safety", "zones.corners", zone["corners"])
    return zone


def _corners(raw: Any) -> list[list[float]]:
    """`"[[0.3, 0.2], …]"`, or `[0.3, 0.2, …]` as older files have it."""
    listed = json.loads(raw) if isinstance(raw, str) else raw
    if listed and not isinstance(listed[0], list):
        listed = [listed[at : at + 2] for at in range(0, len(listed), 2)]
    return [[float(x), float(y)] for x, y in listed]
