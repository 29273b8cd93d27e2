"""Import of the costmaps of a Nav2 parameter file: their layers and their inflation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from missions.nav2 import equivalents as tables
from missions.nav2.equivalents import Equivalent
from missions.nav2.importer import REPLACED, ComponentValues, Importer, Section
from stack.components import component
from stack.costmap.choosing import SENSORS
from stack.costmap.parameters import ObstacleParameters
from stack.parameters import declarations

_USUAL = ({"use": "static"}, {"use": SENSORS})
_OBSTACLES = declarations(ObstacleParameters)


def read_costmaps(importer: Importer) -> None:
    """Import both costmaps.

    What senses obstacles becomes the usual layers of the robot's own sensors; a layer without an
    equivalent never takes them away.
    """
    importer.copy(importer.server("local_costmap"), "costmap", tables.COSTMAP)
    _inflation(importer)
    servers = {which: importer.server(f"{which}_costmap") for which in ("global", "local")}
    lists = [server.get("plugins") for server in servers.values() if server is not None]
    listed = next((part for part in reversed(lists) if part is not None), None)
    if listed is None:
        return  # the robot's own layers
    both: list[dict[str, Any]] = []
    for which, server in servers.items():
        layers = _USUAL if server is None else _layers(importer, server)
        both += [{**layer, "only": which} for layer in layers]
    if not both:
        return
    if not any(layer["use"] == SENSORS and layer["only"] == "local" for layer in both):
        sentence = "no layer senses obstacles: the local costmap shows none that are not on the map"
        importer.warn(REPLACED, listed, sentence, "add an obstacle layer to it")
    values = importer.kinds.setdefault("costmap", ComponentValues())
    values.values["layers"] = _merged(both)
    values.marks["layers"] = listed.node.mark


def _plugins(server: Section) -> Iterator[tuple[Section, str]]:
    """Yield the sections of a costmap's layers that are not disabled, and their classes."""
    names = server.texts("plugins") or list(tables.USUAL_PLUGINS)
    for name in (*names, *server.texts("filters")):
        section = server.get(name) or Section(f"{server.path}.plugins", server.node)
        is_listed = section.node is not server.node
        plugin = section.plugin if is_listed else ""
        if is_listed and not section.is_enabled:
            continue
        if plugin == "PluginContainerLayer":
            yield from _plugins(section)
        else:
            yield section, plugin or tables.USUAL_PLUGINS.get(name, "")


def _layers(importer: Importer, server: Section) -> list[dict[str, Any]]:
    """Return the layers of a costmap; all layers that sense are one."""
    found: dict[str, dict[str, Any]] = {}
    for section, plugin in _plugins(server):
        use = tables.LAYERS.get(plugin)
        if use is None:
            use = SENSORS
            named = section.get("plugin") or section
            sentence = f"no equivalent for the layer {named.node.words()}; the usual layers"
            importer.replace("costmap", section, f"{sentence} of the robot's sensors are used")
        elif plugin in tables.FILTERS:
            sentence = f"no {plugin}: zones and masks are not imported"
            importer.replace("costmap", section, sentence, tables.FILTERS[plugin])
        if not use:
            continue
        named_plugin = section.get("plugin")
        if named_plugin is not None and plugin in tables.LAYERS:
            importer.record(named_plugin, "costmap", "layers", use)
        layer = found.setdefault(use, {"use": use})
        for name, value in _parameters(importer, section, use).items():
            layer[name] = max(value, layer.get(name, value))
    return list(found.values())


def _parameters(importer: Importer, section: Section, use: str) -> dict[str, Any]:
    """Return the parameters of a layer; of several sources the one that reaches farthest."""
    if use == "denoise":
        declared = declarations(component("costmap_layer", use).Parameters)  # type: ignore[attr-defined]
        return importer.copied(section, "costmap.layers", tables.DENOISE, declared)
    values: dict[str, Any] = {}
    for name in section.texts("observation_sources") if use == SENSORS else ():
        source = section.get(name)
        if source is None:
            continue
        found = importer.copied(source, "costmap.layers", tables.SCAN_SOURCE, _OBSTACLES)
        values = {**values, **{key: max(value, values.get(key, value))
                               for key, value in found.items()}}  # fmt: skip
    return values


def _inflation(importer: Importer) -> None:
    """Import the inflation of both costmaps; where they differ, the local one has its own values.

    A costmap without an inflation layer gets the radius 0.
    """
    for server, prefix in ((importer.server("global_costmap"), ""),
                           (importer.server("local_costmap"), "local_")):  # fmt: skip
        listed = None if server is None else server.get("plugins")
        if server is None:
            continue
        layer = next((part for part, plugin in _plugins(server) if plugin == "InflationLayer"),
                     None)  # fmt: skip
        if layer is None and listed is not None:
            none = Equivalent("inflation_radius", lambda _: 0.0)
            _set_inflation(importer, listed, none, prefix)
            continue
        plugin = None if layer is None else layer.get("plugin")
        if plugin is not None:
            importer.record(plugin, "costmap", "inflation", "always")
        for key, equivalent in tables.INFLATION.items():
            part = None if layer is None else layer.get(key)
            if part is not None:
                _set_inflation(importer, part, equivalent, prefix)


def _set_inflation(importer: Importer, part: Section, equivalent: Equivalent, prefix: str) -> None:
    both = importer.kinds.setdefault("costmap", ComponentValues()).values.get(equivalent.name)
    value = importer.converted(part, equivalent.convert)
    if prefix and value is not None and value == both:
        importer.record(part, "costmap", equivalent.name, value)
    else:
        importer.set("costmap", part, Equivalent(prefix + equivalent.name, equivalent.convert))


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
            only, use = layer["only"], layer["use"]
            layer["name"] = only if use == SENSORS else f"{only}_{use}"  # then local_obstacle, too
    return merged
