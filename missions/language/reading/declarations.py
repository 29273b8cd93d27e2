"""Reader of declarations: places, arguments, blackboard keys, `in` and `out` of trees."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from math import inf, nan
from typing import Any

from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import UNSET, Role, Scope, Symbol
from missions.language.expressions.value_types import (
    ANYTHING,
    NUMBER,
    POSE,
    ValueType,
    named_type,
    type_of,
)
from missions.language.foreign_words import ARGUMENT_WORDS, KEY_WORDS, TYPES
from missions.language.keys import ARGUMENT, BLACKBOARD_KEY, INPUT, KEEP, OPTIONAL, TREE
from missions.language.reading.literals import IDENTIFIER
from missions.language.reading.port_expressions import text_of
from missions.language.reading.values import ValueReader
from missions.language.reading.words import WordRole
from missions.language.step import Tree
from missions.language.values import Constant
from stack.documents import Findings, Mark, Node, Section, read_text
from stack.errors import InputError, ParameterError
from stack.parameters import Declaration, did_you_mean, quantity_unit, suggestion, units
from stack.types import Pose2D

Layer = dict[str, Symbol]
_LIST_WORD = re.compile(r"(list|array|vector)\b", re.IGNORECASE)
_FORMS = {"places": "[x, y, heading]", "blackboard": "{type: int, initial: 0}",
          "arguments": "{type: int, default: 0}", "`in`": "Pose", "`out`": "Pose"}  # fmt: skip
_GUESSES = {bool: "bool", int: "int", float: "float", str: "text", list: "list of …"}
_OF_UNITS = {"s": "duration", "m": "length", "rad": "angle", "m/s": "speed",
             "rad/s": "angular_speed", "m/s²": "acceleration"}  # fmt: skip
Overrides = Mapping[str, str | Node]
"""Argument values: a text from `--set`, or a node from a test case."""


class DeclarationReader:
    """Reads the sections of one file that declare names.

    Attributes:
        declared: declarations of the mission's arguments, after they have been read.
    """

    def __init__(self, values: ValueReader) -> None:
        self.values, self.findings, self.words = values, values.findings, values.words
        self.declared: dict[str, Declaration] = {}

    def places(self, node: Node | None, world: Mapping[str, Pose2D], where: Mark) -> Layer:
        """Read places; the mission's own override those of the world."""
        layer = {name: Symbol(name, Role.PLACE, POSE, where, pose) for name, pose in world.items()}
        for key, entry in self._entries(node, "places"):
            name = str(key.value)
            self.words.add(key, WordRole.DECLARED, owner="places")
            try:
                pose = Declaration(name, Pose2D).read(entry.plain())
            except ParameterError as error:
                self.findings.add("E106", entry.mark, str(error), error.hint)
                pose = Pose2D(nan, nan)  # reported once: no goal there is judged
            layer[name] = Symbol(name, Role.PLACE, POSE, key.mark, pose)
        return layer

    def blackboard(self, node: Node | None, scope: Scope) -> Layer:
        """Read blackboard keys: `visited: {type: int, initial: 0}`."""
        layer: Layer = {}
        for key, entry in self._entries(node, "blackboard"):
            self._named(key, entry, "blackboard", "blackboard key")
            if not entry.is_mapping:
                layer[str(key.value)] = self._undeclared(key, entry, Role.KEY, "initial")
                continue
            words = {**{word: word for word in BLACKBOARD_KEY}, **KEY_WORDS}
            section = Section(entry, self.findings, f"the key {key.value!r}", "E101", words).at(key)
            kind = self._type(section)
            initial = section.node_of("initial")
            section.value(OPTIONAL)
            keep = bool(section.value(KEEP))
            if keep and not kind.is_storable:
                sentence = f"{key.value!r} has the type {kind}, which cannot be kept"
                self.findings.add("E136", key.mark, sentence, "remove `keep`")
            doc = section.value(Declaration("doc", str, default=""))
            section.done()
            value = UNSET
            if initial is not None:
                value = self._literal(kind.declaration(str(key.value)), initial, scope)
            layer[str(key.value)] = Symbol(
                str(key.value), Role.KEY, kind, key.mark, value, doc, keep=keep
            )
        return layer

    def arguments(self, node: Node | None, scope: Scope, overrides: Overrides) -> Layer:
        """Read arguments with their values: `dwell: {type: duration, default: 3 s}`."""
        layer: Layer = {}
        for key, entry in self._entries(node, "arguments"):
            name = str(key.value)
            self._named(key, entry, "arguments", "argument")
            if not entry.is_mapping:
                layer[name] = self._undeclared(key, entry, Role.ARGUMENT, "default")
                continue
            words = {**{word: word for word in ARGUMENT}, **ARGUMENT_WORDS}
            section = Section(entry, self.findings, f"the argument {name!r}", "E101", words).at(key)
            declared = self.declared[name] = self._argument(name, section)
            default = section.node_of("default")
            section.done()
            value = UNSET if default is None else self._literal(declared, default, scope)
            if type_of(declared) == ANYTHING:
                value = UNSET  # its type has been reported
            if name in overrides:
                override = self._override(declared, overrides[name], scope)
                value = value if override is UNSET else override  # one finding for one mistake
            elif default is None:
                hint = f"use --set {name}=… or add a default"
                self.findings.add("E108", key.mark, f"the argument {name!r} has no value", hint)
            kind = ANYTHING if value is UNSET else type_of(declared)
            layer[name] = Symbol(
                name, Role.ARGUMENT, kind, key.mark, value, one_of=declared.one_of,
                limits=_limits(declared, kind),
            )  # fmt: skip
        for name in overrides:
            if name not in layer:
                sentence = f"the mission has no argument {name!r}"
                self._wrong_override(name, overrides[name], sentence, suggestion(name, layer))
        return layer

    def _undeclared(self, key: Node, entry: Node, role: Role, value: str) -> Symbol:
        """Report a name with a bare type or value: `n: int`, `n: 3`."""
        what = "key" if role is Role.KEY else "argument"
        sentence = f"the {what} {key.value!r} must be a mapping of keys, got {entry.words()}"
        hint = f"write {key.value}: {{type: …, {value}: …}}"
        if isinstance(entry.value, str) and isinstance(named_type(entry.value), ValueType):
            hint = f"write {key.value}: {{type: {entry.value}, {value}: …}}"
        elif entry.value is not None:
            guess = _GUESSES.get(type(entry.value), "…")
            if isinstance(entry.value, str) and quantity_unit(entry.value):
                guess = _OF_UNITS.get(units()[quantity_unit(entry.value) or ""][0], "float")
            hint = f"write {key.value}: {{type: {guess}, {value}: {text_of(entry)}}}"
        self.findings.add("E101", entry.mark, sentence, hint)
        known = UNSET if role is Role.ARGUMENT else None
        return Symbol(str(key.value), role, ANYTHING, key.mark, known)

    def tree(self, key: Node, node: Node, scope: Scope) -> Tree:
        """Read a tree's name, `in` and `out`; its nodes are read when all trees are known.

        Defaults of `in` can refer to names in `scope`.
        """
        self._named(key, node, "trees", "tree")
        section = Section(node, self.findings, f"the tree {key.value!r}", "E101", [*TREE]).at(key)
        other = next((word for word, _ in node.entries if word.value not in TREE), None)
        if other is not None and section.node.get("do") is None:
            sentence = (
                f"the tree {key.value!r} needs the key 'do'; {other.words()} is no key of a tree"
            )
            self.findings.add("E101", other.mark, sentence, f"write do: {{{other.value}: …}}")
            return Tree(str(key.value), key.mark, {}, {})
        inputs = self._inputs(section.node_of("in"), scope)
        outputs = self._outputs(section.node_of("out"))
        doc = section.node_of("doc")
        section.node_of("events")
        section.node_of("do", required=True)
        section.done()
        for name in inputs:
            if name in outputs:
                mark = outputs[name].mark
                self.findings.add(
                    "E144", mark, f"{name!r} is in both `in` and `out`; rename one of them"
                )
        return Tree(str(key.value), key.mark, inputs, outputs, doc=str(doc.value) if doc else "")

    def _inputs(self, node: Node | None, scope: Scope) -> Layer:
        """Read inputs: a type, or `{type: duration, default: 3 s}`."""
        layer = {
            str(item.value): Symbol(str(item.value), Role.INPUT, ANYTHING, item.mark)
            for item in (node.items if node is not None else [])
        }
        for key, entry in self._entries(node, "`in`"):
            name, value = str(key.value), UNSET
            self.words.add(key, WordRole.DECLARED, owner="in")
            if entry.is_mapping:
                self.words.keys(entry, "input")
                what = f"the input {name!r}"
                section = Section(entry, self.findings, what, "E101", [*INPUT]).at(key)
                kind, default = self._type(section), section.node_of("default")
                section.value(Declaration("doc", str, default=""))
                section.done()
                if default is not None:
                    value = self._literal(kind.declaration(name), default, scope)
                if default is not None and value is UNSET:
                    kind, value = ANYTHING, None  # one finding for one mistake
            else:
                kind = self._type_word(entry)
            layer[name] = Symbol(name, Role.INPUT, kind, key.mark, value)
        return layer

    def _outputs(self, node: Node | None) -> Layer:
        for key, _ in node.entries if node else []:
            self.words.add(key, WordRole.DECLARED, owner="out")
        return {
            str(key.value): Symbol(str(key.value), Role.OUTPUT, self._type_word(entry), key.mark)
            for key, entry in self._entries(node, "`out`")
        }

    def _argument(self, name: str, section: Section) -> Declaration:
        kind = self._type(section)
        declared = kind.declaration(name, help=section.value(Declaration("doc", str, default="")))
        limits, options = section.node_of("range"), section.node_of("one_of")
        if limits is not None:
            try:
                plain = limits.plain() if limits.is_sequence else []
                least, most = (declared_item(kind, name).read(item) for item in plain)
                return replace(declared, at_least=least, at_most=most)
            except (ParameterError, ValueError):
                sentence = f"range must be [least, most] of type {kind}, got {limits.words()}"
                ends = re.findall(r"-?\d+(?:\.\d*[1-9])?", str(limits.value))
                hint = "write the least and the greatest value: [1, 5]"
                if len(ends) == 2 and not limits.is_sequence:
                    hint = f"write [{ends[0]}, {ends[1]}]"
                self.findings.add("E108", limits.mark, sentence, hint)
        if options is not None:
            words = tuple(str(item.value) for item in options.items)
            return replace(declared, one_of=words)
        return declared

    def _type(self, section: Section) -> ValueType:
        node, unit = section.node_of("type", required=True), section.node_of("unit")
        kind = ANYTHING if node is None else self._type_word(node)
        if unit is None:
            return kind
        dimension, factor = units().get(str(unit.value), ("", 0.0))
        of_list = kind.item == NUMBER
        if factor != 1.0 or not (of_list or kind in (NUMBER, ANYTHING)):
            hint = "write an SI unit, e.g. m; types such as `duration` have their unit"
            sentence = f"unit needs `type: float` or a list, and an SI unit, got {unit.words()}"
            self.findings.add("E107", unit.mark, sentence, hint)
        return (
            replace(kind, item=replace(NUMBER, unit=dimension))
            if of_list
            else replace(kind, unit=dimension)
        )

    def _named(self, key: Node, body: Node, owner: str, section: str) -> None:
        """Record the name of a declaration and the keys of its section."""
        self.words.add(key, WordRole.DECLARED, owner=owner)
        self.words.keys(body, section)

    def _type_word(self, node: Node) -> ValueType:
        self.words.add(node, WordRole.TYPE)
        kind = named_type(node.value) if isinstance(node.value, str) else "write a type's name"
        if isinstance(kind, str):
            meant = TYPES.get(str(node.value).lower())
            hint = did_you_mean(meant) if meant else kind
            if _LIST_WORD.match(str(node.value)):
                inner = re.findall(r"\w+", str(node.value))[-1]
                hint = "write the type of its items: list of int, list of Pose"
                if isinstance(named_type(inner), ValueType):
                    hint = f"write list of {inner}"
            self.findings.add("E107", node.mark, f"there is no type {node.words()}", hint)
            return ANYTHING
        return kind

    def _literal(self, declared: Declaration, node: Node, scope: Scope) -> Any:
        """Return the constant value of a node; UNSET after a finding."""
        found = Findings()
        reader = ValueReader(found, self.words)
        value = reader.value(declared, node, NameContext(scope))
        self.values.used.update(reader.used)
        for item in found.items:
            code = "E108" if item.code in ("E132", "E141") else item.code
            self.findings.items.append(replace(item, code=code))
        if value is not None and not isinstance(value, Constant):
            sentence = f"{declared.name}: the value must be known before the mission runs"
            self.findings.add("E108", node.mark, sentence)
        return value.value if isinstance(value, Constant) else UNSET

    def _override(self, declared: Declaration, given: str | Node, scope: Scope) -> Any:
        found = Findings()
        value: Any = None
        try:
            node: Node | None = given if isinstance(given, Node) else None
            if isinstance(given, str):
                node = read_text(f"value: {given}", "--set").get("value")
            if node is not None:
                value = ValueReader(found).value(declared, node, NameContext(scope))
        except InputError as error:
            found.items += error.findings
        for item in found.items:
            self._wrong_override(declared.name, given, item.sentence, item.hint)
        return value.value if isinstance(value, Constant) else UNSET

    def _wrong_override(self, name: str, given: str | Node, sentence: str, hint: str) -> None:
        if isinstance(given, Node):
            self.findings.add("E115", given.mark, sentence, hint)
        else:
            self.findings.add("E109", Mark(f"--set {name}"), sentence, hint)

    def _entries(self, node: Node | None, what: str) -> list[tuple[Node, Node]]:
        """Return the entries of a section whose keys are valid names."""
        if node is None or (node.kind == "scalar" and node.value is None):
            return []
        if not node.is_mapping:
            names = [str(item.value) for item in node.items if item.kind == "scalar"]
            hint = f"write {names[0] if names else 'name'}: {_FORMS[what]} for each"
            sentence = f"{what} must be a mapping, got {node.words()}"
            self.findings.add("E101", node.mark, sentence, hint)
        good = []
        inside = [entry for item in node.items for entry in item.entries]
        for key, value in node.entries or inside:  # a list has been reported
            if isinstance(key.value, str) and IDENTIFIER.fullmatch(key.value):
                good.append((key, value))
            else:
                sentence = f"{key.words()} is not a valid name"
                better = re.sub(r"\W+", "_", str(key.value)).strip("_")
                hint = "use letters, digits and _; start with a letter"
                if IDENTIFIER.fullmatch(better):
                    hint += f": {better}"
                self.values.refused.add(str(key.value))
                self.findings.add("E144", key.mark, sentence, hint)
        return good


def _limits(declared: Declaration, kind: ValueType) -> tuple[float, float]:
    """Return the range of a number; those of a list are of its items."""
    least = -inf if declared.at_least is None else declared.at_least
    most = inf if declared.at_most is None else declared.at_most
    return (least, most) if kind.is_number else (-inf, inf)


def declared_item(kind: ValueType, name: str) -> Declaration:
    """Return the declaration of a range's ends: the type, or the item type of a list."""
    return (kind.item or kind).declaration(name)
