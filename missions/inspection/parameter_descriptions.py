"""`treepilot describe safety.padding_speed`: one parameter, and where it is written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from missions.execution.component_choices import LISTS, SETTINGS, ListSetting
from missions.inspection.declaration_tables import shown, table
from missions.language.reading.header import TOP_COMPONENTS
from stack.components import DEFAULTS, component
from stack.costmap.choosing import SENSORS
from stack.errors import InputError
from stack.parameters import Declaration, declarations, suggestion

LAYER = "costmap_layer"

Components = Mapping[str, Mapping[str, str]]
"""Kind -> name -> `module:Class`."""


@dataclass(frozen=True, slots=True)
class Owner:
    """What has parameters.

    Attributes:
        kind: `safety`, `controller`, `costmap_layer`…
        name: of the component; the kind itself for the settings of a fixed part.
        parameters: their dataclass.
    """

    kind: str
    name: str
    parameters: type


def list_hint(settings: str) -> str:
    """Return how the list of a part's settings is written; empty if it has none."""
    found = LISTS.get(settings)
    if found is None:
        return ""
    lines = [f"{found.key}: {found.help}", f"  {found.example}"]
    if found.item is not None:
        lines.append(f"  `treepilot describe {settings}.{found.key}` lists the keys of an entry")
    return "\n".join(lines)


def parameter_description(name: str, components: Components) -> str:
    """Describe one parameter: help, type, default, range, and where it is written.

    Args:
        name: OWNER.PARAMETER; the owner is a kind, a component or the settings of a part. With a
            kind, all its components that have the parameter are described.
        components: the available components.

    Raises:
        InputError: unknown owner or parameter; the message suggests the most similar one.
    """
    word, _, parameter = name.partition(".")
    owners = list(_owners(components, word))
    if not owners:
        known = {
            *SETTINGS,
            *components,
            *(other for found in components.values() for other in found),
        }
        raise InputError(f"{name}: {word!r} has no parameters; {suggestion(word, known)}")
    listed = LISTS.get(word)
    if listed is not None and parameter == listed.key:
        return _list_description(name, listed)
    groups: list[tuple[Declaration, list[Owner]]] = []
    for owner in owners:
        declared = declarations(owner.parameters).get(parameter)
        if declared is None:
            continue
        same = next((group for group in groups if group[0] == declared), None)
        if same is not None:
            same[1].append(owner)
        else:
            groups.append((declared, [owner]))
    if not groups:
        names = {item for owner in owners for item in declarations(owner.parameters)}
        names |= {listed.key} if listed else set()
        raise InputError(f"{word} has no parameter {parameter!r}; {suggestion(parameter, names)}")
    return "\n\n".join(_description(declared, group) for declared, group in groups)


def owners_of(parameter: str, components: Components) -> list[str]:
    """Return the full names of the parameters with a name: `safety.padding`, sorted."""
    return sorted(
        {
            f"{owner.name if owner.kind == LAYER else owner.kind}.{parameter}"
            for owner in _owners(components)
            if parameter in declarations(owner.parameters)
        }
    )


def _owners(components: Components, word: str = "") -> Iterator[Owner]:
    """Yield what has parameters and is called `word` or of that kind; everything without a word."""
    for settings, parameters in SETTINGS.items():
        if word in ("", settings):
            yield Owner(settings, settings, parameters)
    for kind, found in components.items():
        for name, where in found.items():
            if word in ("", kind, name):
                cls = component(kind, where)
                yield Owner(kind, name, cls.Parameters)  # type: ignore[attr-defined]


def _description(declared: Declaration, owners: list[Owner]) -> str:
    first = owners[0]
    kind = first.name if first.kind == LAYER else first.kind
    rows = [
        ("of", ", ".join(owner.name for owner in owners if owner.name != first.kind)),
        ("type", declared.type_name()),
        ("default", "required" if declared.required else shown(declared)),
        ("range", declared.range_text()),
        *_relations(declared, first.parameters),
        ("write", _written(declared, owners)),
    ]
    if first.kind != LAYER:
        value = f"{declared.default:g}" if _is_number(declared) else _value(declared)
        rows.append(
            ("one run", f"treepilot run MISSION --parameter {kind}.{declared.name}={value}")
        )
    lines = [f"  {title:<8} {text}" for title, text in rows if text]
    return "\n".join([f"{kind}.{declared.name}: {declared.help}", *lines])


def _relations(declared: Declaration, parameters: type) -> Iterator[tuple[str, str]]:
    """Yield what the value must not exceed or fall below, apart from its range."""
    others = declarations(parameters)
    if declared.robot_limit:
        yield "at most", f"`{declared.robot_limit}` of the robot's limits"
    if declared.not_above:
        switch = others[declared.not_above].at_least == 0.0
        yield "at most", declared.not_above + (", unless that is 0" if switch else "")
    for lower in others.values():
        if lower.not_above == declared.name:
            yield "at least", lower.name + (", or 0" if declared.at_least == 0.0 else "")


def _written(declared: Declaration, owners: list[Owner]) -> str:
    """Return the line of a mission that sets the default."""
    first = owners[0]
    pair = f"{declared.name}: {_value(declared)}"
    names = [owner.name for owner in owners]
    if first.kind == LAYER:
        return f"navigation: {{costmap: {{layers: {_layers_with(first.name, pair)}}}}}"
    if first.name != first.kind and DEFAULTS[first.kind] not in names:
        pair = f"use: {first.name}, {pair}"
    line = f"{first.kind}: {{{pair}}}"
    return line if first.kind in TOP_COMPONENTS else f"navigation: {{{line}}}"


def _layers_with(name: str, pair: str) -> str:
    """Return a mission's list of the usual layers with a value of one of them, or of another one.

    The entry of the sensors has the parameters of their obstacle layers.
    """
    entry = f"{{use: {SENSORS if name == 'obstacle' else name}, {pair}}}"
    layers = {"static": "static", "obstacle": SENSORS, name: entry}
    return f"[{', '.join(layers.values())}]"


def _is_number(declared: Declaration) -> bool:
    return isinstance(declared.default, int | float) and not isinstance(declared.default, bool)


def _value(declared: Declaration) -> str:
    """Return the default as a mission writes it; `…` if there is none."""
    if _is_number(declared) or isinstance(declared.default, bool):
        return shown(declared)
    return declared.default if isinstance(declared.default, str) and declared.default else "…"


def _list_description(name: str, listed: ListSetting) -> str:
    lines = [f"{name}: {listed.help}", f"  write    {listed.example}"]
    if listed.item is not None:
        about = (listed.item.__doc__ or "").partition("\n\n")[2]
        lines.append(" ".join(about.split()))
        lines.append(table("keys of an entry", declarations(listed.item).values()))
    return "\n".join(lines)
