"""Reader of port values: a literal, a `$name`, a list of both, a text or an expression."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from missions.language.expressions.arithmetic import MAX_TEXT
from missions.language.expressions.expression import (
    CheckedExpression,
    NameContext,
    check_expression,
)
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.expressions.texts import (
    has_placeholders,
    pieces,
    source_of,
    text_expression,
)
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
    type_word,
)
from missions.language.keys import Keys
from missions.language.reading.commas import report_cut_expression
from missions.language.reading.item_types import Mismatch, item_type
from missions.language.reading.literals import IDENTIFIER, marks_of, read_literal, write_name
from missions.language.reading.port_expressions import (
    computed_source,
    is_text_with_placeholders,
    list_source,
    reference_name,
    text_of,
    within,
    written_as,
)
from missions.language.reading.words import WordRole, Words
from missions.language.values import (
    AssignmentList,
    Computed,
    Constant,
    ExpressionValue,
    ListValue,
    Reference,
    Template,
    Value,
)
from stack.documents import Findings, Mark, Node
from stack.errors import EvaluationError, Hint, ParameterError
from stack.parameters import Declaration, superfluous

_ASSIGNMENT = re.compile(r"\$?(\w+)\s*:?=\s*(.+)")


class ValueReader:
    """Reads values and records the symbols used.

    Attributes:
        used: symbols that are read or written, in the order of their first use.
        written: symbols that are written.
        words: the words of the values.
        refused: invalid names, which were reported where they are declared.
    """

    def __init__(self, findings: Findings, words: Words | None = None) -> None:
        self.findings = findings
        self.words = Words() if words is None else words
        self.used: dict[Symbol, None] = {}
        self.written: dict[Symbol, None] = {}
        self.refused: set[str] = set()

    def keys(  # noqa: PLR0913 - what a section is called and where its words are explained
        self, node: Node, section: str, keys: Keys, code: str, context: NameContext,
        hints: Mapping[str, Hint] | None = None,
    ) -> set[str]:  # fmt: skip
        """Record the keys of a section, report unknown ones and return the keys that they mean."""
        self.words.keys(node, section, context.scope)
        meant = set()
        for key, _ in node.entries:
            word = str(key.value)
            if word not in keys:
                hint = (hints or {}).get(word) or superfluous(word, keys)
                self.findings.add(code, key.mark, f"{section} has no key {key.value!r}", hint)
                meant.add(hint.fix)
        return meant

    def value(
        self, declared: Declaration, node: Node, context: NameContext, owner: str = "",
        options: tuple[str, ...] = (),
    ) -> Value | None:  # fmt: skip
        """Return the checked value of a port; None after a finding.

        Args:
            declared: the port.
            node: its value.
            context: the visible names.
            owner: behaviour of the port, for the words of the file.
            options: words that are allowed besides, already treated.
        """
        kind = type_of(declared)
        if kind == EXPRESSION:
            expression = self.expression(node, context, owner=owner)
            return ExpressionValue(expression) if expression else None
        if kind == ASSIGNMENTS:
            return self._assignments(node, context)
        name = reference_name(node)
        source = None if name is not None else computed_source(node, kind)
        if source is not None:
            written = node if node.kind == "scalar" else written_as(source, node)
            self.words.add(written, WordRole.EXPRESSION, context.scope, owner, declared)
        elif node.kind == "scalar":
            shown = replace(declared, one_of=(*declared.one_of, *options)) if options else declared
            self.words.add(node, WordRole.VALUE, context.scope, owner, shown)
        if name is not None:
            return self._reference(declared, node, name, context)
        if kind.item and node.is_sequence and not _is_single_pose(kind, node):
            return self._listing(declared, kind.item, node, context)
        if kind == TEXT and not declared.one_of and has_placeholders(str(node.value)):
            return self._template(node, context)
        if source is not None:
            return self._computed(declared, node, source, context)
        return read_literal(declared, node, context, self.findings)

    def expression(
        self, node: Node, context: NameContext, wanted: ValueType = BOOL, owner: str = ""
    ) -> CheckedExpression | None:
        """Return a checked expression; None after findings."""
        self.words.add(node, WordRole.EXPRESSION, context.scope, owner)
        source = _source(node)
        if source is None:
            sentence = f"expected an expression, got {node.words()}"
            self.findings.add("E150", node.mark, sentence)
            return None
        checked, problems = self._checked(source, context, wanted)
        for problem in problems:
            hint = problem.hint
            if problem.code == "E151" and wanted == TEXT:
                hint = "write a text in quotes inside the expression: \"'…'\""
            self.findings.add(problem.code, within(node, problem.at), problem.sentence, hint)
        return self._recorded(checked, node.mark)

    def items(self, name: str, node: Node, context: NameContext) -> tuple[Value | None, ValueType]:
        """Return the list of a `for_each` and the type of its items, with the unit."""
        declared = Declaration(name, list[Any])
        if node.is_sequence:
            kind = item_type(node.items, lambda item: self._type_of_reference(item, context))
            if isinstance(kind, Mismatch):
                sentence = f"the items have one type, got {kind.expected} and {kind.found}"
                self.findings.add("E156", kind.item.mark, sentence)
                for item in node.items:
                    self.words.add(item, WordRole.VALUE, context.scope, declared=declared)
                return None, ANYTHING
            declared = ValueType(list, item=kind).declaration(name)
            return self.value(declared, node, context), kind
        value = self.value(declared, node, context)
        if isinstance(value, Computed):
            return value, value.expression.type.item or ANYTHING
        written = reference_name(node)
        symbol = context.scope.lookup(written) if written is not None else None
        return value, (symbol.type.item if symbol else None) or ANYTHING

    def _type_of_reference(self, node: Node, context: NameContext) -> ValueType | None:
        name = reference_name(node)
        if name is None:
            return None
        symbol = context.scope.lookup(name)
        return symbol.type if symbol else ANYTHING

    def _computed(
        self, declared: Declaration, node: Node, source: str, context: NameContext
    ) -> Value | None:
        """Read an expression at a port; one of places and arguments only is a constant."""
        kind = type_of(declared)
        checked, problems = self._checked(source, context, kind)
        for problem in problems:
            place = within(node, problem.at) if node.kind == "scalar" else node.mark
            words = f"{declared.name}: " if problem.code == "E153" else ""
            self.findings.add(problem.code, place, f"{words}{problem.sentence}", problem.hint)
        found = self._recorded(checked, node.mark)
        if found is None or not found.is_constant:
            return Computed(found, kind) if found else None
        try:
            return Constant(declared.read(found.constant()), text_of(node))
        except EvaluationError as error:
            self.findings.add("E157", node.mark, f"{declared.name}: {error.sentence}")
        except ParameterError as error:
            sentence = f"{declared.name} = {source}: {error.sentence}"
            self.findings.add("E132", node.mark, sentence, error.hint)
        return None

    def _checked(
        self, source: str, context: NameContext, wanted: ValueType
    ) -> tuple[CheckedExpression | None, list[ExpressionError]]:
        checked, problems = check_expression(source, context, wanted)
        return checked, [] if any(f"${name}" in source for name in self.refused) else problems

    def _recorded(self, checked: CheckedExpression | None, mark: Mark) -> CheckedExpression | None:
        """Set the position of an expression, and record the symbols that it reads."""
        if checked is None:
            return None
        self.used.update(dict.fromkeys([*checked.read.values(), *checked.tested.values()]))
        return replace(checked, mark=mark)

    def _template(self, node: Node, context: NameContext) -> Template | None:
        """Read a text with placeholders."""
        text, parts, wrong = str(node.value), list[str | CheckedExpression](), False
        if len(text) > MAX_TEXT:
            sentence = f"the text with values has {len(text)} characters; at most {MAX_TEXT}"
            self.findings.add("E150", node.mark, sentence)
            return None
        try:
            for piece in pieces(text):
                if not piece.is_expression:
                    parts.append(piece.text)
                    continue
                mark = within(node, piece.at)
                source, moved = source_of(piece, context.scope)
                checked, problems = self._checked(source, context, ANYTHING)
                for item in problems:
                    place = within(node, piece.at + max(0, item.at + moved))
                    self.findings.add(item.code, place, item.sentence, item.hint)
                found = self._recorded(checked, mark)
                wrong = wrong or found is None
                parts += [found] if found else []
        except ExpressionError as error:
            place = within(node, error.at)
            self.findings.add(error.code, place, error.sentence, error.hint)
            return None
        return None if wrong else Template(tuple(parts), text)

    def target(self, node: Node, context: NameContext, found: ValueType) -> Symbol | None:
        """Return the key that receives an output of this type."""
        self.words.add(node, WordRole.TARGET, context.scope, declared=found.declaration("out"))
        name = reference_name(node)
        if name is None:
            named = isinstance(node.value, str) and IDENTIFIER.fullmatch(node.value)
            hint = write_name(str(node.value)) if named else "write $key"
            self.findings.add(
                "E135", node.mark, f"the target of an output is a $key, got {node.words()}", hint
            )
            return None
        if context.scope.complete and context.scope.lookup(name) is None:
            declared = f"blackboard: {{{name}: {{type: {type_word(found)}, optional: true}}}}"
            hint = context.scope.likely(name) or f"declare it at the top: {declared}"
            self.findings.add("E140", node.mark, f"there is no ${name}", hint)
            return None
        symbol = self.writable(name, node.mark, context)
        if symbol and not symbol.type.accepts(found):
            sentence = f"${name} is {symbol.type}, but the output is {found}"
            self.findings.add("E141", node.mark, sentence, f"use a key of the type {found}")
            return None
        return symbol

    def writable(self, name: str, mark: Mark, context: NameContext) -> Symbol | None:
        """Return the symbol of a name if it can be written; report it otherwise."""
        symbol = self._symbol(name, mark, context)
        if symbol is None:
            return None
        if not symbol.is_writable:
            sentence = f"${name} cannot be written: it is the {symbol.role} {name!r}"
            self.findings.add("E142", mark, sentence, "write a blackboard key")
            return None
        self.written[symbol] = None
        return symbol

    def _symbol(self, name: str, mark: Mark, context: NameContext) -> Symbol | None:
        symbol = context.scope.lookup(name)
        if symbol is None:
            if context.scope.complete:
                self.findings.add("E140", mark, f"there is no ${name}", context.scope.hint(name))
            return None
        self.used[symbol] = None
        return symbol

    def _reference(
        self, declared: Declaration, node: Node, name: str, context: NameContext
    ) -> Value | None:
        symbol = self._symbol(name, node.mark, context)
        if symbol is None:
            return None
        wanted = type_of(declared)
        if not wanted.accepts(symbol.type):
            sentence = f"{declared.name} is {wanted}, but ${name} is {symbol.type}"
            self.findings.add("E141", node.mark, sentence)
            return None
        if not symbol.is_constant:
            return Reference(symbol)
        if symbol.value is UNSET:
            return None  # already reported at the declaration
        try:
            return Constant(declared.read(symbol.value), f"${name}", node.mark)
        except ParameterError as error:
            sentence = f"{declared.name} = ${name}: {error.sentence}"
            self.findings.add("E132", node.mark, sentence, error.hint)
            return None

    def _listing(
        self, declared: Declaration, item: ValueType, node: Node, context: NameContext
    ) -> Value | None:
        each = replace(declared, type=item.annotation, unit=item.unit or declared.unit)
        values = [self.value(each, entry, context) for entry in node.items]
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        if all(isinstance(value, Constant) for value in known):
            plain = [value.value for value in known if isinstance(value, Constant)]
            return Constant(plain, text_of(node), node.mark, marks_of(node))
        return ListValue(tuple(known))

    def _assignments(self, node: Node, context: NameContext) -> AssignmentList | None:
        if not node.is_mapping or not node.entries:
            self.words.add(node, WordRole.KEY, context.scope)
            sentence = f"expected keys with expressions, got {node.words()}"
            pair = _ASSIGNMENT.fullmatch(str(node.value))
            hint = f"write {{{pair[1]}: {pair[2]}}}" if pair else "write {key: expression}"
            self.findings.add("E132", node.mark, sentence, hint)
            return None
        if report_cut_expression(node, self.findings):
            return None
        pairs: list[tuple[Symbol, CheckedExpression]] = []
        for key, entry in node.entries:
            self.words.add(key, WordRole.KEY, context.scope)
            name = str(key.value)
            if name.startswith("$") and context.scope.lookup(name[1:]):
                sentence = f"set names a key without $, got {name!r}"
                self.findings.add("E140", key.mark, sentence, f"write `{name[1:]}: …`")
                continue
            symbol = self.writable(str(key.value), key.mark, context)
            wanted = symbol.type if symbol else ValueType(object)
            expression = self._assigned(entry, context, wanted)
            if symbol and expression:
                pairs.append((symbol, expression))
        return AssignmentList(tuple(pairs)) if len(pairs) == len(node.entries) else None

    def _assigned(
        self, node: Node, context: NameContext, wanted: ValueType
    ) -> CheckedExpression | None:
        """Read the value of an assignment: an expression, a list of them, or a text with `${}`."""
        if wanted in (TEXT, ANYTHING) and is_text_with_placeholders(node):
            self.words.add(node, WordRole.VALUE, context.scope, declared=wanted.declaration("text"))
            template = self._template(node, context)
            return text_expression(template.parts, template.text, node.mark) if template else None
        if node.is_sequence:
            source = list_source(node, wanted)
            node = replace(written_as(source, node), quoted="\n" in source)
        return self.expression(node, context, wanted)


def _is_single_pose(kind: ValueType, node: Node) -> bool:
    # `[1, 2, 0]` for a list of poses is read as a whole: the error then mentions the list.
    return kind.item == POSE and all(item.kind == "scalar" and not reference_name(item)
                                     for item in node.items) and bool(node.items)  # fmt: skip


def _source(node: Node) -> str | None:
    value: Any = node.value
    if node.kind != "scalar" or value is None:
        return None
    return text_of(node)
