"""Completion: candidates for a position in a mission file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from behaviours.kind import BehaviourKind
from missions.editor.document import CURSOR, Reading
from missions.editor.hover import parameters_of, signature_of_kind, symbol_text, tree_text
from missions.editor.markdown import behaviour_text, declaration_text, word_text
from missions.execution.component_choices import NAVIGATION_KINDS
from missions.execution.resources import world_files
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES
from missions.language.expressions.scope import Role, Symbol
from missions.language.expressions.terms import POSE_FIELDS
from missions.language.expressions.value_types import (
    ANYTHING,
    BOOL,
    INT,
    NAMED,
    POSE,
    TEXT,
    type_of,
)
from missions.language.keys import ANY_KEY, MISSION, MODIFIERS, Keys
from missions.language.kinds import NODES
from missions.language.reading.cases import FIXED_VALUES
from missions.language.reading.words import Word, WordRole
from missions.language.sections import ONLY_FOR, SECTIONS
from robots.load import robot_names
from stack.components import DEFAULTS, available
from stack.parameters import Declaration


@dataclass(frozen=True)
class Candidate:
    """A completion candidate.

    Attributes:
        label: text to show and insert.
        kind: "keyword", "behaviour", "port", "value", "name", "function", "tree" or "file".
        detail: short text next to the label.
        text: documentation as markdown.
        key: whether a `:` follows the label.
        value: text to insert after the `:`.
        after: text to insert after the label.
    """

    label: str
    kind: str
    detail: str = ""
    text: str = ""
    key: bool = False
    value: str = ""
    after: str = ""


def candidates(
    reading: Reading, word: Word, *, alone: bool, typed: str = "", inside_text: bool = False
) -> list[Candidate]:
    """Return the candidates for a word.

    Args:
        reading: the file.
        word: the placeholder for the typed word.
        alone: whether the word is the first in its line, so that it can become a key.
        typed: the typed part of the word.
        inside_text: whether the word stands in a `${…}`.
    """
    if inside_text:
        names = () if typed.startswith("$") else reading.known(word).values()
        return [*map(_plain_name, names), *_expressions(reading, word, typed)]
    if word.role is WordRole.EXPRESSION or _in_expression(word, typed):
        found = list(_expressions(reading, word, typed))
    else:
        provider = _PROVIDERS.get(word.role)
        found = list(provider(reading, word)) if provider else []
    found += map(_word, word.options)
    if alone and word.role in (WordRole.VALUE, WordRole.EXPRESSION) and word.owner:
        found += _ports(reading, word)
    if alone and word.role is WordRole.COMPONENT:
        found += _parameters(word.owner)
    return found


def new_file() -> list[Candidate]:
    """Return the candidates for the first word of an empty file."""
    return list(_keys(MISSION))


def _word(option: str) -> Candidate:
    return Candidate(option, "value")


def _keys(keys: Keys) -> Iterator[Candidate]:
    for word, key in keys.items():
        if word != ANY_KEY:
            yield Candidate(word, "keyword", text=key.doc, key=True)


def _section_keys(reading: Reading, word: Word) -> Iterator[Candidate]:
    yield from _keys(SECTIONS[word.owner])


def _kinds(reading: Reading, word: Word) -> Iterator[Candidate]:
    for name in NODES:
        yield Candidate(name, "keyword", text=word_text(name), key=True)
    catalogue = reading.words.catalogue
    for name in catalogue.names() if catalogue else ():
        kind = catalogue.get(name) if catalogue else None
        if kind is None:
            continue
        has_required = any(declared.required for declared in kind.ports.values())
        yield Candidate(name, "behaviour", kind.summary, behaviour_text(kind),
                        key=bool(kind.ports), value="" if has_required else "{}")  # fmt: skip


def _modifiers(reading: Reading, word: Word) -> Iterator[Candidate]:
    catalogue = reading.words.catalogue
    kind = catalogue.get(word.owner) if catalogue and word.owner not in NODES else None
    for name in _allowed_modifiers(word.owner, kind):
        yield Candidate(name, "keyword", text=word_text(name), key=True)


def _allowed_modifiers(word: str, kind: BehaviourKind | None) -> list[str]:
    """Return the modifiers allowed for a type; `kind` is set for a behaviour."""
    allowed = [name for name in MODIFIERS if word in ONLY_FOR.get(name, (word,))]
    takes_outputs = NODES[word].takes_outputs if word in NODES else kind and kind.outputs
    if not takes_outputs:
        allowed.remove("out")
    return allowed


def _ports(reading: Reading, word: Word) -> Iterator[Candidate]:
    ports, _ = signature_of_kind(reading, word.owner)
    yield from _declared(ports.values())


def _outputs(reading: Reading, word: Word) -> Iterator[Candidate]:
    tree = reading.words.trees.get(word.owner)
    yield from _declared(signature_of_kind(reading, word.owner)[1].values())
    yield from _signature(tree.outputs if tree else {})


def _inputs(reading: Reading, word: Word) -> Iterator[Candidate]:
    tree = reading.words.trees.get(word.owner)
    yield from _signature(tree.inputs if tree else {})


def _signature(symbols: Mapping[str, Symbol]) -> Iterator[Candidate]:
    for name, symbol in symbols.items():
        yield Candidate(name, "port", str(symbol.type), key=True)


def _declared(items: Iterable[Declaration]) -> Iterator[Candidate]:
    for declared in items:
        yield Candidate(declared.name, "port", declared.type_name(), declaration_text(declared),
                        key=True)  # fmt: skip


def _values(reading: Reading, word: Word) -> Iterator[Candidate]:
    wanted = type_of(word.declared) if word.declared else ANYTHING
    if wanted == BOOL:
        yield from (_word("true"), _word("false"))
    for symbol in reading.known(word).values():
        fits = wanted.accepts(symbol.type) or (wanted.item and wanted.item.accepts(symbol.type))
        if fits:
            yield _reference(reading, symbol)
    if wanted.of is float or wanted in (INT, POSE):
        yield from _functions()


def _reference(reading: Reading, symbol: Symbol) -> Candidate:
    return Candidate(
        f"${symbol.name}", "name", f"{symbol.role}, {symbol.type}", symbol_text(reading, symbol)
    )


def _plain_name(symbol: Symbol) -> Candidate:
    return Candidate(symbol.name, "name", f"{symbol.role}, {symbol.type}")


def _in_expression(word: Word, typed: str) -> bool:
    """Return whether the value of a port already has the beginning of an expression."""
    kind = type_of(word.declared) if word.declared else ANYTHING
    if word.role is not WordRole.VALUE or kind in (TEXT, ANYTHING):
        return False
    return "." in typed or bool(str(word.node.value).partition(CURSOR)[0].strip(" -("))


def _functions() -> Iterator[Candidate]:
    for name, function in FUNCTIONS.items():
        yield Candidate(name, "function", function.signature, function.help, after="(")
    yield Candidate(DISTANCE, "function", f"{DISTANCE}(place)", "distance to a pose", after="(")


def _expressions(reading: Reading, word: Word, typed: str) -> Iterator[Candidate]:
    """Yield what can stand in an expression; after `$name.` the fields of a pose."""
    name, dot, _ = typed.removeprefix("$").rpartition(".")
    known = reading.known(word)
    if dot and typed.startswith("$"):
        symbol = known.get(name)
        fields = POSE_FIELDS.items() if symbol is not None and symbol.type == POSE else ()
        for field, kind in fields:
            yield Candidate(f"${name}.{field}", "value", str(kind))
        return
    yield from (_reference(reading, symbol) for symbol in known.values())
    for value, item in ROBOT_VALUES.items():
        yield Candidate(value, "value", str(item.type), item.help)
    yield from _functions()
    yield from (Candidate(operator, "keyword") for operator in ("and", "or", "not", "is set"))


def _writable(reading: Reading, word: Word) -> Iterator[Symbol]:
    return (symbol for symbol in reading.known(word).values() if symbol.is_writable)


def _targets(reading: Reading, word: Word) -> Iterator[Candidate]:
    yield from (_reference(reading, symbol) for symbol in _writable(reading, word))


def _written(reading: Reading, word: Word) -> Iterator[Candidate]:
    for symbol in _writable(reading, word):
        yield Candidate(symbol.name, "name", f"{symbol.role}, {symbol.type}", key=True)


def _trees(reading: Reading, word: Word) -> Iterator[Candidate]:
    for tree in reading.words.trees.values():
        yield Candidate(tree.name, "tree", text=tree_text(tree))


def _types(reading: Reading, word: Word) -> Iterator[Candidate]:
    for name, kind in NAMED.items():
        yield Candidate(name, "value", str(kind))
        yield Candidate(f"list of {name}", "value")


def _of_role(reading: Reading, word: Word, role: Role) -> Iterator[Symbol]:
    return (symbol for symbol in reading.known(word).values() if symbol.role is role)


def _places(reading: Reading, word: Word) -> Iterator[Candidate]:
    for place in _of_role(reading, word, Role.PLACE):
        yield Candidate(place.name, "name", place.role, symbol_text(reading, place))


def _arguments(reading: Reading, word: Word) -> Iterator[Candidate]:
    for symbol in _of_role(reading, word, Role.ARGUMENT):
        yield Candidate(symbol.name, "name", str(symbol.type), key=True)


def _changes(reading: Reading, word: Word) -> Iterator[Candidate]:
    """Yield what a test can change: robot values, keys and events."""
    for name, item in ROBOT_VALUES.items():
        if name not in FIXED_VALUES:
            yield Candidate(name, "value", str(item.type), item.help, key=True)
    for symbol in _of_role(reading, word, Role.KEY):
        yield Candidate(f"${symbol.name}", "name", str(symbol.type), key=True)
    yield Candidate("event", "keyword", text="Trigger an event.", key=True)


def _expectations(reading: Reading, word: Word) -> Iterator[Candidate]:
    yield from _keys(SECTIONS["expectation"])
    for symbol in _of_role(reading, word, Role.KEY):
        yield Candidate(symbol.name, "name", str(symbol.type), key=True)


def _files(reading: Reading, word: Word) -> Iterator[Candidate]:
    folder = reading.path.parent
    for file in sorted(folder.glob("*.yaml")) if word.owner != "plugins" else ():
        if file != reading.path:
            yield Candidate(file.name, "file")


def _parameters(owner: str) -> Iterator[Candidate]:
    if owner.split(" ")[0] in DEFAULTS:
        yield Candidate("use", "keyword", text="Name of the component.", key=True)
    yield from _declared(parameters_of(owner).values())


def _components(reading: Reading, word: Word) -> Iterator[Candidate]:
    yield from (_word(name) for name in (available(word.owner) if word.owner in DEFAULTS else ()))


def _component_kinds(reading: Reading, word: Word) -> Iterator[Candidate]:
    return (Candidate(kind, "keyword", key=True) for kind in NAVIGATION_KINDS)


def _faults(reading: Reading, word: Word) -> Iterator[Candidate]:
    from stack.sim.faults.registry import fault_kind, fault_names, summary_of

    for name in fault_names():
        yield Candidate(name, "keyword", summary_of(fault_kind(name)), key=True)
    yield from _keys(SECTIONS["fault"])


def _file_stems(files: Iterable[Path]) -> Iterator[Candidate]:
    return (_word(file.stem) for file in files)


_PROVIDERS: dict[WordRole, Callable[[Reading, Word], Iterable[Candidate]]] = {
    WordRole.SECTION_KEY: _section_keys, WordRole.COMPONENT_KIND: _component_kinds,
    WordRole.PARAMETER: lambda reading, word: _parameters(word.owner),
    WordRole.WORLD: lambda reading, word: _file_stems(world_files()),
    WordRole.ROBOT: lambda reading, word: map(_word, robot_names()),
    WordRole.KIND: _kinds, WordRole.MODIFIER: _modifiers, WordRole.PORT: _ports,
    WordRole.INPUT: _inputs, WordRole.OUTPUT: _outputs, WordRole.VALUE: _values,
    WordRole.TARGET: _targets, WordRole.KEY: _written, WordRole.TREE: _trees,
    WordRole.TYPE: _types, WordRole.PLACE: _places, WordRole.FILE: _files,
    WordRole.COMPONENT: _components, WordRole.ARGUMENT: _arguments, WordRole.CHANGE: _changes,
    WordRole.EXPECTATION: _expectations, WordRole.FAULT: _faults,
}  # fmt: skip
