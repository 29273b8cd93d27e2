"""Readers of `switch` and `unset`, and the check of the code of `fail`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Protocol

from missions.language.expressions.expression import CheckedExpression, NameContext
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.expressions.terms import Named
from missions.language.expressions.value_types import ANYTHING, TEXT
from missions.language.keys import SWITCH, required
from missions.language.model import Constant, Step, Switch, Unset, Value
from missions.language.reading.port_expressions import text_of
from missions.language.reading.values import ValueReader
from stack.documents import Findings, Mark, Node
from stack.parameters import nearest, suggestion
from stack.types import FailureCode

TYPING_SLIP = 0.9
"""Similarity from which a code counts as a misspelt one; that of DOOR_LOCKED is 0.82."""

_CODE = re.compile(r"[A-Z][A-Z0-9_]*")


class ReadsNodes(Protocol):
    """A reader of nodes."""

    @property
    def values(self) -> ValueReader:
        """The reader of values."""
        ...

    @property
    def findings(self) -> Findings:
        """The findings so far."""
        ...

    def read(self, node: Node, context: NameContext) -> Step | None:
        """Read a node; None after a finding."""
        ...


def read_switch(
    reader: ReadsNodes, start: Step, body: Node | None, context: NameContext
) -> Switch | None:
    """Read `switch: {value: $mode, cases: {fast: …}, default: …}`."""
    if body is None or not body.is_mapping:
        got = "nothing" if body is None else body.words()
        sentence = f"switch must be {{value: …, cases: {{…}}, default: …}}, got {got}"
        hint = "indent `value:` and `cases:` below `switch:`"
        reader.findings.error("E170", body.mark if body else start.mark, sentence, hint)
        return None
    reader.values.words.keys(body, "switch", context.scope)
    for key, _ in body.entries:
        if key.value not in SWITCH:
            hint = suggestion(str(key.value), SWITCH)
            reader.findings.error("E170", key.mark, f"switch has no key {key.value!r}", hint)
    for word in required(SWITCH):
        if body.get(word) is None:
            reader.findings.error("E170", start.mark, f"switch needs `{word}`")
    given, listed, other = (body.get(word) for word in ("value", "cases", "default"))
    value = reader.values.expression(given, context, TEXT) if given else None
    default = reader.read(other, context) if other else None
    cases = _cases(reader, listed, context) if listed else {}
    if value is None or not cases or (other and default is None):
        return None
    if listed is not None:
        _check_cases(reader.findings, value, listed, default)
    return Switch(start.kind, start.mark, start.name, start.modifiers, value, cases, default)


def _cases(reader: ReadsNodes, listed: Node, context: NameContext) -> dict[str, Step]:
    if not listed.is_mapping or not listed.entries:
        sentence = f"cases must be a mapping {{text: node}}, got {listed.words()}"
        hint = "remove the `- `: each text is a key" if listed.is_sequence else ""
        reader.findings.error("E170", listed.mark, sentence, hint)
    cases: dict[str, Step] = {}
    for key, node in listed.entries:
        if not isinstance(key.value, str):
            hint = f'write "{key.value}" in quotes'
            reader.findings.error("E170", key.mark, f"a case is a text, got {key.words()}", hint)
        step = reader.read(node, context)
        if step is not None:
            cases[str(key.value)] = step
    return cases


def _check_cases(
    findings: Findings, value: CheckedExpression, listed: Node, default: Step | None
) -> None:
    """Report cases that the value cannot have, and values of an enum without a case."""
    options, own = _options(value)
    if not options:
        return
    for key, _ in listed.entries:
        if key.value not in options and not (own and key.quoted):
            sentence = f"{value.source} is never {key.value!r}"
            hint = suggestion(str(key.value), options)
            if key.value in ("default", "else", "otherwise"):
                hint = "write `default:` beside `cases:`, not below it"
            findings.error("E170", key.mark, sentence, hint)
    missing = [word for word in options if word not in [key.value for key, _ in listed.entries]]
    if missing and default is None and not own:
        sentence = f"no case for {', '.join(missing)}, and no `default`: the node fails then"
        findings.warning("W170", listed.mark, sentence)


def _options(value: CheckedExpression) -> tuple[tuple[str, ...], bool]:
    """Return the texts that a value can have (empty: any), and whether others in quotes can be."""
    if isinstance(value.term, Named) and value.term.name == "error":
        return tuple(FailureCode.__members__), True
    symbols = list(value.read.values())
    if len(symbols) == 1 and value.source.strip() == f"${symbols[0].name}":
        return symbols[0].one_of, False
    return (), False


def read_unset(
    reader: ReadsNodes, start: Step, body: Node | None, context: NameContext
) -> Unset | None:
    """Read `unset: $photo` or a list."""
    if body is None or (body.kind == "scalar" and body.value is None) or body.is_mapping:
        got = "nothing" if body is None else body.words()
        reader.findings.error("E171", start.mark, f"unset needs a $key or a list, got {got}")
        return None
    targets: list[Symbol] = []
    for item in body.items if body.is_sequence else [body]:
        symbol = reader.values.target(item, context, ANYTHING)
        if symbol is None:
            continue
        if symbol.value is not UNSET:
            sentence = f"${symbol.name} has an initial value and cannot be unset"
            hint = "remove `initial` and declare it `optional: true`, or use `set`"
            reader.findings.error("E171", item.mark, sentence, hint)
        targets.append(symbol)
    return Unset(start.kind, start.mark, start.name, start.modifiers, tuple(targets))


def loop_hint(body: Node | None) -> str:
    """Return how to write what stands below `for_each:`."""
    if body is not None and body.is_sequence:
        return f"write {{item: {text_of(body)}}}"
    words = [str(key.value) for key, _ in body.entries] if body is not None else []
    if "do" in words:
        return "write `do:` beside `for_each:`, not below it"
    if len(words) == 1 and words[0].startswith("$"):
        return f"write the name of the variable without $: {words[0][1:]}"
    return "write several lists as nested loops" if len(words) > 1 else "write {shelf: […]}"


def check_failure_code(ports: Mapping[str, Value], mark: Mark, findings: Findings) -> None:
    """Report a code of `fail` that is misspelt, or that stands where the reason stands."""
    code, reason = ports.get("code"), ports.get("because")
    if isinstance(reason, Constant) and "_" in str(reason.value):
        text = str(reason.value)
        if "code" not in ports and _CODE.fullmatch(text):
            text = nearest(text, list(FailureCode.__members__)) or text
            sentence = f"{str(reason.value)!r} is the reason of the failure here, not its code"
            hint = f"write {{code: {text}, because: a sentence}}"
            findings.error("E172", mark, sentence, hint)
    if not isinstance(code, Constant) or code.value in FailureCode.__members__:
        return
    text = str(code.value)
    if _CODE.fullmatch(text) and not get_close_matches(
        text, FailureCode.__members__, 1, TYPING_SLIP
    ):
        return
    near = nearest(text.upper(), list(FailureCode.__members__))
    hint = f"did you mean {near!r}?" if near else "write capitals, digits and _: SHELF_EMPTY"
    findings.error("E172", mark, f"{text!r} is not a failure code", hint)
