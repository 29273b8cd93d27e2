"""What stands at a port, read: a literal, a `$name`, a list of both, or an expression."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from missions.language.expressions.expression import (
    CheckedExpression,
    Surroundings,
    check_expression,
)
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.expressions.texts import is_filled_in, pieces, source_of
from missions.language.expressions.tokens import ExpressionError
from missions.language.expressions.value_types import (
    ANYTHING,
    ASSIGNMENTS,
    BOOL,
    EXPRESSION,
    POSE,
    TEXT,
    ValueType,
    type_of,
)
from missions.language.model import (
    AssignmentList,
    Constant,
    ExpressionValue,
    ListValue,
    Reference,
    Template,
    Value,
)
from stack.documents import Findings, Mark, Node, iter_scalars
from stack.errors import ParameterError
from stack.parameters import Declaration, suggestion

_REFERENCE = re.compile(r"\$([A-Za-z_]\w*)")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def reference_name(node: Node) -> str | None:
    """The name when the node is `$name`; a quoted text never is."""
    if node.quoted or not isinstance(node.value, str):
        return None
    found = _REFERENCE.fullmatch(node.value)
    return found[1] if found else None


class ValueReader:
    """Reads values and remembers which symbols were used.

    Attributes:
        used: symbols that something reads or writes, in the order of their first use.
        written: symbols that something writes.
    """

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self.used: dict[Symbol, None] = {}
        self.written: dict[Symbol, None] = {}

    def value(self, declared: Declaration, node: Node, around: Surroundings) -> Value | None:
        """The checked value of a port; None after a finding."""
        kind = type_of(declared)
        if kind == EXPRESSION:
            expression = self.expression(node, around)
            return ExpressionValue(expression) if expression else None
        if kind == ASSIGNMENTS:
            return self._assignments(node, around)
        name = reference_name(node)
        if name is not None:
            return self._reference(declared, node, name, around)
        if kind.item and node.is_sequence and not _looks_like_numbers_of_a_pose(kind, node):
            return self._listing(declared, kind.item, node, around)
        if kind == TEXT and not declared.one_of and is_filled_in(str(node.value)):
            return self._template(node, around)
        return self._literal(declared, node, around)

    def expression(
        self, node: Node, around: Surroundings, wanted: ValueType = BOOL
    ) -> CheckedExpression | None:
        """A checked expression; None after findings."""
        source = _source(node)
        if source is None:
            sentence = f"an expression is wanted here, got {node.words()}"
            self.findings.error("E150", node.mark, sentence)
            return None
        checked, problems = check_expression(source, around, wanted)
        for problem in problems:
            hint = problem.hint
            if problem.code == "E151" and wanted == TEXT:
                hint = "a text stands in quotes inside the expression: \"'…'\""
            self.findings.error(problem.code, _within(node, problem.at), problem.sentence, hint)
        return self._noted(checked, node.mark)

    def _noted(self, checked: CheckedExpression | None, mark: Mark) -> CheckedExpression | None:
        """An expression at its place; what it reads is used."""
        if checked is None:
            return None
        self.used.update(dict.fromkeys([*checked.read.values(), *checked.tested.values()]))
        return replace(checked, mark=mark)

    def _template(self, node: Node, around: Surroundings) -> Template | None:
        """A text with `${…}` in it."""
        text, parts, wrong = str(node.value), list[str | CheckedExpression](), False
        try:
            for piece in pieces(text):
                if not piece.is_expression:
                    parts.append(piece.text)
                    continue
                mark = _within(node, piece.at)
                source, moved = source_of(piece, around.scope)
                checked, problems = check_expression(source, around, ANYTHING)
                for item in problems:
                    place = _within(node, piece.at + max(0, item.at + moved))
                    self.findings.error(item.code, place, item.sentence, item.hint)
                found = self._noted(checked, mark)
                wrong = wrong or found is None
                parts += [found] if found else []
        except ExpressionError as error:
            place = _within(node, error.at)
            self.findings.error(error.code, place, error.sentence, error.hint)
            return None
        return None if wrong else Template(tuple(parts), text)

    def target(self, node: Node, around: Surroundings, found: ValueType) -> Symbol | None:
        """The key that an output of a type goes to."""
        name = reference_name(node)
        if name is None:
            hint = f"write ${node.value}" if isinstance(node.value, str) else "write $key"
            self.findings.error(
                "E135", node.mark, f"an output goes to a $key, got {node.words()}", hint
            )
            return None
        symbol = self.writable(name, node.mark, around)
        if symbol and not symbol.type.accepts(found):
            sentence = f"${name} is {symbol.type}, the output is {found}"
            self.findings.error("E141", node.mark, sentence)
            return None
        return symbol

    def writable(self, name: str, mark: Mark, around: Surroundings) -> Symbol | None:
        """A symbol that may be written."""
        symbol = self._symbol(name, mark, around)
        if symbol is None:
            return None
        if not symbol.is_writable:
            self.findings.error("E142", mark, f"${name} is a {symbol.role} and cannot be written")
            return None
        self.written[symbol] = None
        return symbol

    def _symbol(self, name: str, mark: Mark, around: Surroundings) -> Symbol | None:
        symbol = around.scope.lookup(name)
        if symbol is None:
            hint = suggestion(name, around.scope.names())
            self.findings.error("E140", mark, f"there is no ${name}", hint)
            return None
        self.used[symbol] = None
        return symbol

    def _reference(
        self, declared: Declaration, node: Node, name: str, around: Surroundings
    ) -> Value | None:
        symbol = self._symbol(name, node.mark, around)
        if symbol is None:
            return None
        wanted = type_of(declared)
        if not wanted.accepts(symbol.type):
            sentence = f"{declared.name} is {wanted}, but ${name} is {symbol.type}"
            self.findings.error("E141", node.mark, sentence)
            return None
        if not symbol.is_constant:
            return Reference(symbol)
        if symbol.value is UNSET:
            return None  # what is wrong with it has been reported where it is declared
        try:
            return Constant(declared.read(symbol.value), f"${name}")
        except ParameterError as error:
            sentence = f"{declared.name} = ${name}: {error.sentence}"
            self.findings.error("E132", node.mark, sentence, error.hint)
            return None

    def _listing(
        self, declared: Declaration, item: ValueType, node: Node, around: Surroundings
    ) -> Value | None:
        each = replace(declared, type=item.annotation, unit=item.unit or declared.unit)
        values = [self.value(each, entry, around) for entry in node.items]
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        if all(isinstance(value, Constant) for value in known):
            plain = [value.value for value in known if isinstance(value, Constant)]
            return Constant(plain, text_of(node))
        return ListValue(tuple(known))

    def _literal(self, declared: Declaration, node: Node, around: Surroundings) -> Constant | None:
        for scalar in iter_scalars(node):
            self._warn_of_unfilled_text(scalar, around)
        try:
            return Constant(declared.read(node.plain()), text_of(node))
        except ParameterError as error:
            word = str(node.value).lstrip("$")
            hint = error.hint or (f"write ${word}" if around.scope.lookup(word) else "")
            self.findings.error("E132", node.mark, f"{declared.name}: {error.sentence}", hint)
            return None

    def _warn_of_unfilled_text(self, scalar: Node, around: Surroundings) -> None:
        if not isinstance(scalar.value, str) or scalar.quoted:
            return
        inside = _REFERENCE.search(scalar.value)
        if inside and around.scope.lookup(inside[1]):
            sentence = f"{inside[0]} inside a text is not filled in"
            hint = f"write ${{{inside[1]}}}, or quote the text"
            self.findings.warning("W104", _within(scalar, inside.start()), sentence, hint)

    def _assignments(self, node: Node, around: Surroundings) -> AssignmentList | None:
        if not node.is_mapping or not node.entries:
            sentence = f"wanted are keys with expressions, got {node.words()}"
            self.findings.error("E132", node.mark, sentence, "write {key: expression}")
            return None
        pairs: list[tuple[Symbol, CheckedExpression]] = []
        for key, entry in node.entries:
            symbol = self.writable(str(key.value), key.mark, around)
            wanted = symbol.type if symbol else ValueType(object)
            expression = self.expression(entry, around, wanted)
            if symbol and expression:
                pairs.append((symbol, expression))
        return AssignmentList(tuple(pairs)) if len(pairs) == len(node.entries) else None


def text_of(node: Node) -> str:
    """A literal in one line, as it is written: what drawings of the tree show."""
    if node.is_sequence:
        return f"[{', '.join(text_of(item) for item in node.items)}]"
    if node.is_mapping:
        pairs = (f"{key.value}: {text_of(value)}" for key, value in node.entries)
        return f"{{{', '.join(pairs)}}}"
    if isinstance(node.value, bool):
        return "true" if node.value else "false"
    return str(node.value)


def _looks_like_numbers_of_a_pose(kind: ValueType, node: Node) -> bool:
    # `[1, 2, 0]` for a list of poses: read as a whole, so that the message speaks of the list.
    return kind.item == POSE and all(item.kind == "scalar" and not reference_name(item)
                                     for item in node.items) and bool(node.items)  # fmt: skip


def _source(node: Node) -> str | None:
    value: Any = node.value
    if node.kind != "scalar" or value is None:
        return None
    return text_of(node)


def _within(node: Node, offset: int) -> Mark:
    """The position of an offset in a scalar, as long as it stands in one line."""
    if not isinstance(node.value, str) or "\n" in node.value:
        return node.mark
    return Mark(node.mark.file, node.mark.line, node.mark.column + offset + node.quoted)
