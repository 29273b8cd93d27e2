"""Completion: candidates for a position in a mission file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from missions.editor.document import Reading
from missions.editor.hover import parameters_of, tree_text
from missions.editor.markdown import (
    behaviour_text,
    declaration_text,
    word_text,
)
from missions.editor.names import Name
from missions.editor.node_schemas import allowed_modifiers
from missions.editor.outline import Item, Use, signature_of_kind
from missions.execution.component_choices import DEFAULTS, NAVIGATION_KINDS
from missions.execution.resources import world_files
from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.language.expressions.value_types import BOOL, NAMED, ValueType, type_of
from missions.language.keys import EVENT, MISSION, TREE, docs
from missions.language.kinds import NODES
from robots.load import robot_names
from stack.components import available
from stack.parameters import Declaration

WRITABLE = ("blackboard key", "`out`")


@dataclass(frozen=True)
class Candidate:
    """A completion candidate.

    Attributes:
        label: text to show and insert.
        kind: "keyword", "behaviour", "port", "value", "name", "tree" or "file".
        detail: short text next to the label.
        text: documentation as markdown.
        key: whether a `:` follows the label.
        value: text to insert after the `:`.
    """

    label: str
    kind: str
    detail: str = ""
    text: str = ""
    key: bool = False
    value: str = ""


def candidates(reading: Reading, item: Item, *, alone: bool) -> list[Candidate]:
    """Return the candidates for an item.

    Args:
        reading: the file.
        item: the placeholder for the typed word.
        alone: whether the word is the first in its line, so that it can become a key.
    """
    provider = _PROVIDERS.get(item.use)
    found = list(provider(reading, item)) if provider else []
    key = item.use in (Use.SUB_KEY, Use.CASE_KEY)
    found += [Candidate(word, "keyword" if key else "value", key=key) for word in item.options]
    if alone and item.use in (Use.VALUE, Use.EXPRESSION) and item.owner:
        found += _ports(reading, item)
    if alone and item.use is Use.COMPONENT:
        found += _parameters(item.owner)
    return found


def _word(option: str) -> Candidate:
    return Candidate(option, "value")


def _keys(texts: dict[str, str]) -> Iterator[Candidate]:
    for word, text in texts.items():
        yield Candidate(word, "keyword", text=text, key=True)


def _kinds(reading: Reading, item: Item) -> Iterator[Candidate]:
    for word in NODES:
        yield Candidate(word, "keyword", text=word_text(word), key=True)
    for name in reading.catalogue.names():
        kind = reading.catalogue.kinds[name]
        has_required = any(declared.required for declared in kind.ports.values())
        yield Candidate(name, "behaviour", kind.summary, behaviour_text(kind),
                        key=bool(kind.ports), value="" if has_required else "{}")  # fmt: skip


def _modifiers(reading: Reading, item: Item) -> Iterator[Candidate]:
    kind = reading.catalogue.get(item.owner)
    for word in allowed_modifiers(item.owner, kind):
        yield Candidate(word, "keyword", text=word_text(word), key=True)


def _ports(reading: Reading, item: Item) -> Iterator[Candidate]:
    ports, _ = signature_of_kind(reading.catalogue, item.owner)
    yield from _declared(ports.values())


def _outputs(reading: Reading, item: Item) -> Iterator[Candidate]:
    tree = reading.names.trees.get(item.owner)
    yield from _declared(signature_of_kind(reading.catalogue, item.owner)[1].values())
    yield from _signature(tree.signature[1] if tree else {})


def _inputs(reading: Reading, item: Item) -> Iterator[Candidate]:
    tree = reading.names.trees.get(item.owner)
    yield from _signature(tree.signature[0] if tree else {})


def _signature(types: object) -> Iterator[Candidate]:
    assert isinstance(types, dict)
    for name, kind in types.items():
        yield Candidate(name, "port", str(kind), key=True)


def _declared(items: Iterable[Declaration]) -> Iterator[Candidate]:
    for declared in items:
        yield Candidate(declared.name, "port", declared.type_name(), declaration_text(declared),
                        key=True)  # fmt: skip


def _values(reading: Reading, item: Item) -> Iterator[Candidate]:
    wanted = type_of(item.declared) if item.declared else ValueType(object)
    if wanted == BOOL:
        yield from (_word("true"), _word("false"))
    for name in reading.names.known(item.scope).values():
        fits = wanted.accepts(name.type) or (wanted.item and wanted.item.accepts(name.type))
        if fits:
            yield _reference(name)


def _reference(name: Name) -> Candidate:
    return Candidate(f"${name.name}", "name", f"{name.role}, {name.type}", f"`{name.text}`")


def _expressions(reading: Reading, item: Item) -> Iterator[Candidate]:
    yield from (_reference(name) for name in reading.names.known(item.scope).values())
    for word, value in ROBOT_VALUES.items():
        yield Candidate(word, "value", str(value.type), value.help)
    yield from (Candidate(word, "keyword") for word in ("and", "or", "not", "is set"))


def _writable(reading: Reading, item: Item) -> Iterator[Name]:
    known = reading.names.known(item.scope).values()
    return (name for name in known if name.role.startswith(WRITABLE))


def _targets(reading: Reading, item: Item) -> Iterator[Candidate]:
    yield from (_reference(name) for name in _writable(reading, item))


def _written(reading: Reading, item: Item) -> Iterator[Candidate]:
    for name in _writable(reading, item):
        yield Candidate(name.name, "name", f"{name.role}, {name.type}", key=True)


def _trees(reading: Reading, item: Item) -> Iterator[Candidate]:
    for tree in reading.names.trees.values():
        yield Candidate(tree.name, "tree", text=tree_text(tree))


def _types(reading: Reading, item: Item) -> Iterator[Candidate]:
    for word, kind in NAMED.items():
        yield Candidate(word, "value", str(kind))
        yield Candidate(f"list of {word}", "value")


def _places(reading: Reading, item: Item) -> Iterator[Candidate]:
    for place in reading.names.places.values():
        yield Candidate(place.name, "name", place.role, f"`{place.text}`")


def _files(reading: Reading, item: Item) -> Iterator[Candidate]:
    if item.owner == "map":
        yield from (_word("from_world"), _word("none"))
    folder = reading.names.path.parent
    for file in sorted(folder.glob("*.yaml")) if item.owner != "plugins" else ():
        if file != reading.names.path:
            yield Candidate(file.name, "file")


def _parameters(owner: str) -> Iterator[Candidate]:
    if owner.split(" ")[0] in DEFAULTS:
        yield Candidate("use", "keyword", text="Name of the component.", key=True)
    yield from _declared(parameters_of(owner).values())


def _components(reading: Reading, item: Item) -> Iterator[Candidate]:
    yield from (_word(name) for name in (available(item.owner) if item.owner in DEFAULTS else ()))


def _file_stems(files: Iterable[Path]) -> Iterator[Candidate]:
    return (_word(file.stem) for file in files)


_PROVIDERS: dict[Use, Callable[[Reading, Item], Iterable[Candidate]]] = {
    Use.TOP_KEY: lambda reading, item: _keys(docs(MISSION)),
    Use.TREE_KEY: lambda reading, item: _keys(docs(TREE)),
    Use.EVENT_KEY: lambda reading, item: _keys(docs(EVENT)),
    Use.COMPONENT_KIND: lambda reading, item: _keys(dict.fromkeys(NAVIGATION_KINDS, "")),
    Use.PARAMETER: lambda reading, item: _parameters(item.owner),
    Use.WORLD: lambda reading, item: _file_stems(world_files()),
    Use.ROBOT: lambda reading, item: map(_word, robot_names()),
    Use.KIND: _kinds, Use.MODIFIER: _modifiers, Use.PORT: _ports, Use.INPUT: _inputs,
    Use.OUTPUT: _outputs, Use.VALUE: _values, Use.EXPRESSION: _expressions, Use.TARGET: _targets,
    Use.KEY: _written, Use.TREE: _trees, Use.TYPE: _types, Use.PLACE: _places, Use.FILE: _files,
    Use.COMPONENT: _components,
}  # fmt: skip
