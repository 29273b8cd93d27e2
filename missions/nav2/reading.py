"""Read a `nav2_params.yaml` and import the parameters that have an equivalent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from missions.nav2 import equivalents as tables
from missions.nav2.collision_monitor import read_zones
from missions.nav2.costmaps import read_costmaps
from missions.nav2.equivalents import Equivalent
from missions.nav2.importer import ComponentValues, Ignored, Imported, Importer, Section
from missions.nav2.ros_nodes import nodes_of_robot
from stack.components import DEFAULTS, noun
from stack.documents import Finding, Node, read_ros_parameters, require_kind
from stack.documents.file_kinds import NAV2


@dataclass(frozen=True)
class Nav2Settings:
    """Settings imported from a Nav2 parameter file.

    Attributes:
        kinds: planner, controller, costmap, navigator, safety -> their imported settings.
        imported: imported parameters, in the order of the import.
        ignored: parameters without an equivalent, in the order of the file.
        warnings: about duplicate keys, changed values and replaced plugins; sorted by position.
    """

    kinds: Mapping[str, ComponentValues]
    imported: tuple[Imported, ...]
    ignored: tuple[Ignored, ...]
    warnings: tuple[Finding, ...] = ()


def read_nav2(path: Path, text: str | None = None, namespace: str | None = None) -> Nav2Settings:
    """Read a Nav2 parameter file.

    Args:
        path: of the file.
        text: to read instead of the file's.
        namespace: of the robot, in a file with several.

    Raises:
        InputError: the file cannot be read, is not a Nav2 parameter file, has values of a wrong
            type, or several robots of which none is chosen.
    """
    document, findings = read_ros_parameters(path, NAV2, text)
    top = require_kind(document, NAV2)
    importer = Importer(nodes_of_robot(top, namespace), findings)
    _controller_server(importer)
    _planner_server(importer)
    read_costmaps(importer)
    importer.copy(importer.server("behavior_server"), "navigator", tables.BEHAVIOURS)
    _velocity_smoother(importer)
    read_zones(importer)
    importer.settle()
    findings.raise_errors()
    kinds = {kind: chosen for kind, chosen in importer.kinds.items()
             if chosen.use or chosen.values}  # fmt: skip
    warnings = sorted(findings.items, key=lambda item: item.mark)
    return Nav2Settings(
        kinds, tuple(importer.imported), tuple(importer.ignored()), tuple(warnings)
    )  # fmt: skip


def _first(server: Section, plural: str, default: str) -> Section | None:
    """Return the section of the first listed plugin; older files use the singular key."""
    names = server.texts(plural) or server.texts(plural.removesuffix("s")) or [default]
    return server.get(names[0])


def _controller_server(importer: Importer) -> None:
    server = importer.server("controller_server")
    if server is None:
        return
    importer.copy(server, "navigator", tables.CONTROLLER_SERVER)
    for kind, name, known in (
        ("goal_checker", "goal_checker", tables.GOAL_CHECKERS),
        ("progress_checker", "progress_checker", tables.PROGRESS_CHECKERS),
    ):
        section = _first(server, f"{kind}_plugins", name)
        if section is not None:
            _component(importer, kind, section, known, tables.SHARED[kind])
    section = _first(server, "controller_plugins", "FollowPath")
    if section is not None:
        _controller(importer, section)


def _component(
    importer: Importer, kind: str, section: Section,
    known: Mapping[str, tuple[str, tables.Table]], shared: tables.Table,
) -> str:  # fmt: skip
    """Import a component; of an unknown one the parameters that the default has too.

    Returns:
        The name of the component; empty if the default takes its place.
    """
    if section.plugin in known:
        use, table = known[section.plugin]
        importer.use(kind, section, use)
        importer.copy(section, kind, table)
        return use
    kept: dict[str, Equivalent] = {}
    for key, equivalent in shared.items():
        known_names = {other.name for other in kept.values()}
        if section.get(key) is not None and equivalent.name not in known_names:
            kept[key] = equivalent
    plugin = section.get("plugin")
    named = plugin.node.words() if plugin is not None else "a plugin without a name"
    sentence = f"no equivalent for {named}; the default {noun(kind)} is used"
    words = f"; imported for it: {', '.join(kept)}" if kept else ""
    hint = f"choose another one under `navigation: {{{kind}: …}}`"
    importer.replace(kind, section, sentence + words, hint)
    importer.copy(section, kind, kept)
    return ""


def _controller(importer: Importer, section: Section) -> None:
    primary = section.get("primary_controller")
    shim = section.plugin == "RotationShimController" and primary is not None
    if shim and primary is not None and primary.node.is_mapping:  # its own section, since Jazzy
        inner = primary
    elif shim and primary is not None:
        inner = _with_plugin(section, primary.node)
    else:
        inner = section
    ours = _component(importer, "controller", inner, tables.CONTROLLERS, tables.SPEEDS)
    if shim:
        driving = ours or DEFAULTS["controller"]
        importer.copy(section, "controller", tables.SHIM.get(driving, tables.SHIM[""]))
    if ours == "pure_pursuit":
        _lookahead(importer, inner)
    if ours == "mppi":
        _critics(importer, inner)


def _with_plugin(section: Section, plugin: Node) -> Section:
    """Return a section with another plugin: older rotation shims share theirs with a controller."""
    entries = [(key, plugin if key.value == "plugin" else value)
               for key, value in section.node.entries]  # fmt: skip
    return Section(section.path, replace(section.node, value=entries))


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
    section = _first(server, "planner_plugins", "GridBased") if server is not None else None
    if section is None:
        return
    _component(importer, "planner", section, tables.PLANNERS, tables.SHARED["planner"])
    importer.copy(server, "planner", tables.PLANNER_SERVER)
    smoothers = importer.server("smoother_server")
    listed = None if smoothers is None else _first(smoothers, "smoother_plugins", "simple_smoother")
    plugin = listed.get("plugin") if listed is not None else None
    if listed is not None and plugin is not None and listed.plugin in tables.SMOOTHERS:
        smoother = listed
        name = tables.SMOOTHERS[smoother.plugin]
        importer.set("planner", plugin, Equivalent("smoother", lambda _: name))


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
