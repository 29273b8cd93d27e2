"""Reader of ports and outputs of a node, checked against its behaviour or tree."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Symbol
from missions.language.expressions.value_types import (
    ASSIGNMENTS,
    EXPRESSION,
    POSE,
    ValueType,
    type_of,
)
from missions.language.foreign_words import POSE_PARTS, meant_port
from missions.language.keys import MODIFIERS
from missions.language.reading.commas import report_cut_expression
from missions.language.reading.values import ValueReader
from missions.language.reading.words import WordRole
from missions.language.values import Value
from stack.documents import Mark, Node
from stack.parameters import Declaration, did_you_mean, suggestion, superfluous


@dataclass(frozen=True, slots=True)
class Owner:
    """The behaviour or tree whose ports are read, with the position of its name.

    Attributes:
        misplaced: names that are written beside it; they are reported as unknown modifiers.
    """

    name: str
    mark: Mark
    is_tree: bool = False
    misplaced: Collection[str] = ()


class PortReader:
    """Reads the values below a node's type, under `with` and under `out`."""

    def __init__(self, values: ValueReader) -> None:
        self.values, self.findings = values, values.findings

    def of_behaviour(
        self, ports: Mapping[str, Declaration], body: Node | None, owner: Owner,
        context: NameContext,
    ) -> dict[str, Value]:  # fmt: skip
        """Read the ports of a behaviour: by name, or a single value."""
        if body is None or (body.kind == "scalar" and body.value is None):
            return self.by_name(ports, None, owner, context)
        bare = bare_port(ports)
        if not body.is_mapping and bare is None:
            self.values.words.add(body, WordRole.PORT, context.scope, owner.name)
        takes_keys = bare is not None and (
            type_of(ports[bare]) == ASSIGNMENTS
            or (type_of(ports[bare]) == POSE and _is_like_a_pose(body, ports))
        )
        if body.is_mapping and not takes_keys:
            return self.by_name(ports, body, owner, context)
        if bare is None:
            sentence = f"{owner.name}: it is not clear which port {body.words()} is for"
            hint = f"name the port: {', '.join(ports)}" if ports else "it has no ports"
            self.findings.add("E133", body.mark, sentence, hint)
            return {}
        value = self.values.value(ports[bare], body, context, owner.name)
        self._missing(ports, (bare,), owner)
        return {bare: value} if value else {}

    def by_name(
        self, ports: Mapping[str, Declaration], body: Node | None, owner: Owner,
        context: NameContext, role: WordRole = WordRole.PORT,
    ) -> dict[str, Value]:  # fmt: skip
        """Read ports from a mapping of names; `role` is that of the names."""
        values: dict[str, Value] = {}
        words = self.values.words
        if body is not None and not body.is_mapping:
            words.add(body, role, context.scope, owner.name)
        if body is not None and not body.is_mapping and body.value is not None:
            self.findings.add("E132", body.mark, f"`with` must be a mapping, got {body.words()}")
            return values
        if body is not None and report_cut_expression(body, self.values.findings):
            return values
        given = [] if body is None else body.entries
        named = [str(key.value) for key, _ in given]
        for key, node in given:
            word = str(key.value)
            words.add(key, role, context.scope, owner.name, ports.get(word))
            if word not in ports:
                word = self._unknown(key, ports, owner, named)
                if not word:
                    continue
                named.append(word)
            value = self.values.value(ports[word], node, context, owner.name)
            if value is not None:
                values[word] = value
        self._missing(ports, named, owner)
        return values

    def _unknown(
        self, key: Node, ports: Mapping[str, Declaration], owner: Owner, named: Collection[str]
    ) -> str:
        """Report an unknown port; return the port that is meant, "" if it is not clear."""
        word = str(key.value)
        meant = meant_port(word, ports)
        hint: str = did_you_mean(meant) if meant else superfluous(word, ports)
        if word in MODIFIERS and word not in ("name", "do", "out"):
            meant, hint = "", f"{word} is a modifier: write it beside `{owner.name}:`"
        elif owner.is_tree and not ports:
            hint = f"declare it in the tree: in: {{{word}: TYPE}}"
        self.findings.add("E130", key.mark, f"{owner.name} has no port {word!r}", hint)
        return "" if meant in named else meant

    def outputs(
        self, results: Mapping[str, ValueType], node: Node | None, owner: Owner,
        context: NameContext,
    ) -> dict[str, Symbol]:  # fmt: skip
        """Read the targets of outputs: `out: {image: $photo}`."""
        targets: dict[str, Symbol] = {}
        if node is None:
            return targets
        words = self.values.words
        if not node.is_mapping:
            words.add(node, WordRole.OUTPUT, context.scope, owner.name)
            sentence = f"`out` must be a mapping {{output: $key}}, got {node.words()}"
            first = next(iter(results), "output")
            hint = f"write out: {{{first}: {node.value}}}" if node.kind == "scalar" else ""
            self.findings.add("E135", node.mark, sentence, hint)
        for key, target in node.entries:
            word = str(key.value)
            declared = results[word].declaration(word) if word in results else None
            words.add(key, WordRole.OUTPUT, context.scope, owner.name, declared)
            if word not in results:
                sentence = f"{owner.name} has no output {word!r}"
                self.findings.add("E134", key.mark, sentence, suggestion(word, results))
                continue
            symbol = self.values.target(target, context, results[word])
            if symbol is not None:
                targets[word] = symbol
        return targets

    def _missing(
        self, ports: Mapping[str, Declaration], given: Iterable[str], owner: Owner
    ) -> None:
        names = list(given)
        for name, declared in ports.items():
            if declared.required and name not in names and name not in owner.misplaced:
                kind = type_of(declared)
                words = "expression" if kind == EXPRESSION else str(kind)
                sentence = f"{owner.name} needs the port {name!r} ({words})"
                hint = f"add `{name}: …`" + (" below `with:`" if owner.is_tree else "")
                hint += f": {declared.help}" if declared.help else ""
                self.findings.add("E131", owner.mark, sentence, hint)


def _is_like_a_pose(body: Node, ports: Mapping[str, Declaration]) -> bool:
    """Return whether a mapping is a pose by the names of its parts, as in other tools."""
    names = {str(key.value) for key, _ in body.entries}
    return bool(names) and names <= POSE_PARTS and not names & set(ports)


def bare_port(ports: Mapping[str, Declaration]) -> str | None:
    """Return the port that receives a value without a port name; None if it is ambiguous.

    The only port of type expression or assignments; else the only required port; else the only
    port.
    """
    special = [
        name for name, declared in ports.items() if type_of(declared) in (EXPRESSION, ASSIGNMENTS)
    ]
    required = [name for name, declared in ports.items() if declared.required]
    for names in (special, required, list(ports)):
        if len(names) == 1:
            return names[0]
    return None
