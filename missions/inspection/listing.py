"""`treepilot list` and `treepilot describe`: behaviours, components, robots, worlds, missions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from behaviours.catalogue import Catalogue, find_behaviours
from missions.execution.component_choices import SETTINGS
from missions.execution.plugin_components import plugged_components
from missions.execution.resources import (
    find_mission,
    load_robot,
    mission_files,
    world_files,
)
from missions.inspection.file_descriptions import (
    CURRENT_FOLDER,
    doc_of,
    file_description,
    is_file_name,
    mission_description,
    named_world_description,
    robot_description,
    robot_summary,
)
from missions.inspection.parameter_descriptions import (
    list_hint,
    owners_of,
    parameter_description,
)
from missions.inspection.tables import aligned, parameter_table, table
from missions.language.keys import MODIFIERS
from missions.language.kinds import NODES
from missions.language.sections import ONLY_FOR, SECTIONS
from robots.load import robot_names
from stack.components import available, component
from stack.documents import read_file
from stack.drivetrain.needs import needs_text
from stack.errors import InputError
from stack.parameters import Declaration, declarations, suggestion

COMPONENTS = {
    "planners": "planner",
    "controllers": "controller",
    "goal_checkers": "goal_checker",
    "progress_checkers": "progress_checker",
    "estimators": "localisation",
    "odometry": "odometry",
    "layers": "costmap_layer",
}
"""Word of `treepilot list` -> kind of component."""


@dataclass(frozen=True, slots=True)
class Installed:
    """The available behaviours and components: built in, installed, and of a mission's plugins.

    Attributes:
        catalogue: the behaviours.
        components: kind -> name -> `module:Class`.
    """

    catalogue: Catalogue
    components: Mapping[str, Mapping[str, str]]

    @property
    def problems(self) -> list[str]:
        """Plugins that cannot be used: file and reason."""
        return [f"{item.file}: {item.sentence}" for item in self.catalogue.problems]


def installed(mission: str | None = None) -> Installed:
    """Return the available behaviours and components, with those of a mission's plugins.

    Raises:
        InputError: the mission cannot be read, or a plugin's component uses an existing name.
    """
    plugins: list[str] = []
    folder: Path | None = None
    if mission is not None:
        path = find_mission(mission)
        named = read_file(path, "mission").get("plugins")
        plugins = [str(item.value) for item in (named.items if named else []) if item.value]
        folder = path.parent
    of_plugins = plugged_components(plugins, folder)
    components = {
        kind: {**available(kind), **of_plugins.get(kind, {})} for kind in COMPONENTS.values()
    }
    return Installed(find_behaviours(plugins, folder), components)


def rows_of(kind: str, known: Installed) -> list[tuple[str, str]]:
    """Return the name and a one-line description of everything of a kind."""
    if kind == "behaviours":
        catalogue = known.catalogue
        return [(name, _kind_summary(catalogue, name)) for name in catalogue.names()]
    if kind == "nodes":
        return [(word, item.doc) for word, item in NODES.items()]
    if kind == "modifiers":
        return [(word, key.doc) for word, key in MODIFIERS.items()]
    if kind == "robots":
        return [(name, robot_summary(name)) for name in robot_names()]
    if kind in COMPONENTS:
        component_kind = COMPONENTS[kind]
        found = known.components[component_kind]
        return [
            (name, _first_line(component(component_kind, where))) for name, where in found.items()
        ]
    files = world_files() if kind == "worlds" else mission_files()
    return [(file.stem, _file_summary(file)) for file in files]


def description_of(name: str, known: Installed, *, expert: bool = False) -> str:
    """Return the documentation and settings of a behaviour, node, component, robot or world.

    A name with a slash or a suffix is that of a file of a robot, world, map, mission or trees. One
    with a dot is that of one parameter; for a kind of component, its components are listed.

    Raises:
        InputError: unknown name; the message suggests the most similar one.
    """
    if is_file_name(name):
        return file_description(name)
    kind = known.catalogue.get(name)
    if kind is not None:
        parts = [f"{name}: {kind.doc}", needs_text(kind.needs), table("ports", kind.ports.values())]
        return "\n".join(filter(None, [*parts, _outputs(kind.outputs.values())]))
    if name in NODES or name in MODIFIERS:
        return _describe_word(name)
    if any(name in found for found in known.components.values()):
        return _describe_component(name, known, expert)
    if name in SETTINGS:
        doc, fields = SETTINGS[name].__doc__, declarations(SETTINGS[name])
        parts = [f"{name}: {(doc or '').strip()}", parameter_table(fields.values(), expert=expert)]
        return "\n".join(filter(None, [*parts, list_hint(name)]))
    if "." in name:
        return parameter_description(name, known.components)
    listed = _describe_shipped(name) or _describe_kind(name, known)
    if listed:
        return listed
    raise _unknown(name, known)


def _describe_shipped(name: str) -> str:
    """Describe a robot, world or mission of treepilot; empty for another name."""
    if name in robot_names():
        return robot_description(load_robot(name, CURRENT_FOLDER))
    worlds = {file.stem: file for file in world_files()}
    if name in worlds:
        return named_world_description(name, worlds[name])
    missions = {file.stem: file for file in mission_files()}
    return mission_description(missions[name]) if name in missions else ""


def _describe_component(name: str, known: Installed, expert: bool) -> str:
    kind = next(kind for kind, found in known.components.items() if name in found)
    cls = component(kind, known.components[kind][name])
    fields = declarations(cls.Parameters)  # type: ignore[attr-defined]
    needs = needs_text(cls.needs)  # type: ignore[attr-defined]
    parameters = parameter_table(fields.values(), expert=expert)
    return "\n".join(filter(None, [f"{name}: {(cls.__doc__ or '').strip()}", needs, parameters]))


def _describe_kind(name: str, known: Installed) -> str:
    """Return the components of a kind (`controller` or `controllers`); empty for another name."""
    kinds = next((words for words, kind in COMPONENTS.items() if name in (words, kind)), "")
    if not kinds:
        return ""
    return f"{aligned(kinds, rows_of(kinds, known))}\nparameters of one: treepilot describe NAME"


def _unknown(name: str, known: Installed) -> InputError:
    """Return the error for an unknown name, with the most similar one."""
    names = [other for found in known.components.values() for other in found]
    names += [
        *known.catalogue.names(),
        *NODES,
        *MODIFIERS,
        *SETTINGS,
        *robot_names(),
        *(file.stem for file in (*world_files(), *mission_files())),
    ]
    parameters = owners_of(name, known.components)
    if parameters:
        many = " or ".join(f"`treepilot describe {item}`" for item in parameters[:3])
        return InputError(f"{name} is a parameter; use {many}")
    return InputError(
        f"no behaviour, node, component, robot, world or mission is called {name!r}; "
        f"{suggestion(name, names)}"
    )


def _describe_word(word: str) -> str:
    """Describe a node or modifier of the language."""
    if word in NODES:
        kind = NODES[word]
        keeps = f"keeps from tick to tick: {kind.keeps or 'nothing'}"
        parts = [f"{word}: {kind.doc}", keeps, table("ports", kind.ports.values()),
                 _outputs(kind.outputs.values())]  # fmt: skip
        return "\n".join(filter(None, parts))
    key = MODIFIERS[word]
    only = ONLY_FOR.get(word)
    where = f"only for: {', '.join(only)}" if only else ""
    rows = [(inner.word, "required" if inner.required else "", inner.doc)
            for inner in SECTIONS.get(key.section, {}).values()]  # fmt: skip
    return "\n".join(filter(None, [f"{word}: {key.doc}", where, aligned("keys", rows)]))


def _outputs(declared: Iterable[Declaration]) -> str:
    """Return the table of outputs, which have neither default nor range."""
    return aligned("outputs", [(item.name, item.type_name(), item.help) for item in declared])


def _kind_summary(catalogue: Catalogue, name: str) -> str:
    kind = catalogue.get(name)
    return str(kind.summary) if kind is not None else ""


def _file_summary(file: Path) -> str:
    try:
        return doc_of(file)
    except InputError as error:
        return f"cannot be read: {error}"


def _first_line(cls: type) -> str:
    return (cls.__doc__ or "").strip().partition("\n")[0]
