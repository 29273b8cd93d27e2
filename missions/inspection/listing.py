"""`treepilot list` and `treepilot describe`: behaviours, components, robots, worlds, missions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from inspect import cleandoc
from pathlib import Path
from typing import Any

from behaviours.catalogue import Catalogue, find_behaviours
from missions.execution.component_choices import SETTINGS
from missions.execution.fit.faults import fault_files
from missions.execution.plugin_components import plugged_components
from missions.execution.resources import (
    find_mission,
    load_robot,
    mission_files,
    world_files,
)
from missions.inspection.declaration_tables import aligned, parameter_table, table
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
from missions.language.keys import MODIFIERS
from missions.language.kinds import NODES
from missions.language.sections import ONLY_FOR, SECTIONS, mission_words
from robots.load import robot_names
from stack.components import available, component, noun
from stack.documents import read_file
from stack.drivetrain.needs import needs_text
from stack.errors import InputError
from stack.parameters import Declaration, declarations, suggestion
from stack.sim.faults.fault import BEFORE, LASTING, NOW
from stack.sim.faults.registry import fault_kind, fault_names, summary_of

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
    return Installed(find_behaviours(plugins, folder, mission_words()), components)


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
    if kind == "faults":
        kinds = [(name, summary_of(fault_kind(name))) for name in fault_names()]
        return [*kinds, *((name, _file_summary(file)) for name, file in fault_files().items())]
    files = world_files() if kind == "worlds" else mission_files()
    return [(file.stem, _file_summary(file)) for file in files]


def description_of(name: str, known: Installed, *, expert: bool = False) -> str:
    """Return the documentation and settings of a behaviour, node, component, robot or world.

    A name with a slash or a suffix is that of a file of a robot, world, map, mission or trees. One
    with a dot is that of one parameter; for a kind of component, its components are listed. All
    that has the name is described: `depth` is a costmap layer and settings.

    Raises:
        InputError: unknown name; the message suggests the most similar one.
    """
    if is_file_name(name):
        return file_description(name)
    found = [
        *_words(name, known), *_components(name, known, expert), *_faults(name), *_shipped(name)
    ]  # fmt: skip
    if len(found) == 1:
        return found[0][1]
    if found:
        return "\n\n".join(f"{what} {text}" for what, text in found)
    if "." in name:
        return parameter_description(name, known.components)
    raise _unknown(name, known)


def _words(name: str, known: Installed) -> Iterator[tuple[str, str]]:
    """Yield what of the language has a name, and its description."""
    behaviour = known.catalogue.get(name)
    if behaviour is not None:
        yield "behaviour", _lines(
            f"{name}: {behaviour.doc}", needs_text(behaviour.needs),
            table("ports", behaviour.ports.values()), _outputs(behaviour.outputs.values()),
        )  # fmt: skip
    if name in NODES:
        yield "node", _describe_node(name)
    if name in MODIFIERS:
        yield "modifier", _describe_modifier(name)


def _components(name: str, known: Installed, expert: bool) -> Iterator[tuple[str, str]]:
    """Yield the components and settings with a name, and a kind of component with its list."""
    for kind, components in known.components.items():
        if name in components:
            yield noun(kind), _describe_component(name, component(kind, components[name]), expert)
    if name in SETTINGS:
        fields = declarations(SETTINGS[name]).values()
        heading = f"{name}: {(SETTINGS[name].__doc__ or '').strip()}"
        yield "settings", _lines(heading, parameter_table(fields, expert=expert), list_hint(name))
    if name == "faults":
        rows = aligned(name, rows_of(name, known))
        yield "faults", f"{rows}\nnumbers of one: treepilot describe NAME"
    for words, kind in COMPONENTS.items():
        if name in (words, kind):
            rows = aligned(words, rows_of(words, known))
            yield "kind of component", f"{rows}\nparameters of one: treepilot describe NAME"


def _faults(name: str) -> Iterator[tuple[str, str]]:
    """Yield the kind of fault, or the shipped file of faults, with a name; and the list of all."""
    if name in fault_names():
        kind = fault_kind(name)
        timing = {
            LASTING: "", NOW: "happens in one moment: no `for`",
            BEFORE: "is there before the run: neither `at` nor `for`",
        }[kind.kind]  # fmt: skip
        parameters = parameter_table(declarations(kind.Parameters).values(), expert=True)
        yield "fault", _lines(f"{name}: {cleandoc(kind.__doc__ or '')}", timing, parameters)
    if name in fault_files():
        yield "file of faults", fault_files()[name].read_text("utf-8").rstrip()


def _shipped(name: str) -> Iterator[tuple[str, str]]:
    """Yield the robot, world and mission of treepilot with a name."""
    if name in robot_names():
        yield "robot", robot_description(load_robot(name, CURRENT_FOLDER))
    for file in world_files():
        if file.stem == name:
            yield "world", named_world_description(name, file)
    for file in mission_files():
        if file.stem == name:
            yield "mission", mission_description(file)


def _lines(*parts: str) -> str:
    return "\n".join(filter(None, parts))


def _describe_component(name: str, cls: Any, expert: bool) -> str:
    parameters = parameter_table(declarations(cls.Parameters).values(), expert=expert)
    return _lines(f"{name}: {(cls.__doc__ or '').strip()}", needs_text(cls.needs), parameters)


def _unknown(name: str, known: Installed) -> InputError:
    """Return the error for an unknown name, with the most similar one."""
    names = [other for found in known.components.values() for other in found]
    names += [
        *known.catalogue.names(),
        *NODES,
        *MODIFIERS,
        *SETTINGS,
        *robot_names(),
        *fault_names(),
        *fault_files(),
        *(file.stem for file in (*world_files(), *mission_files())),
    ]
    parameters = owners_of(name, known.components)
    if parameters:
        many = " or ".join(f"`treepilot describe {item}`" for item in parameters[:3])
        return InputError(f"{name} is a parameter; use {many}")
    return InputError(
        f"no behaviour, node, component, fault, robot, world or mission is called {name!r}; "
        f"{suggestion(name, names)}"
    )


def _describe_node(word: str) -> str:
    kind = NODES[word]
    return _lines(
        f"{word}: {kind.doc}", f"keeps from tick to tick: {kind.keeps or 'nothing'}",
        table("ports", kind.ports.values()), _outputs(kind.outputs.values()),
    )  # fmt: skip


def _describe_modifier(word: str) -> str:
    key, only = MODIFIERS[word], ONLY_FOR.get(word)
    rows = [(inner.word, "required" if inner.required else "", inner.doc)
            for inner in SECTIONS.get(key.section, {}).values()]  # fmt: skip
    where = f"only for: {', '.join(only)}" if only else ""
    return _lines(f"{word}: {key.doc}", where, aligned("keys", rows))


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
