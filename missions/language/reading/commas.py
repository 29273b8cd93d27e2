"""Expressions without quotes that YAML ends at a comma: `{set: {l: append($l, 1)}}`."""

from __future__ import annotations

from missions.language.expressions.tokens import balance
from stack.documents import Findings, Node


def report_cut_expression(node: Node, findings: Findings) -> bool:
    """Report the first value of a mapping that ends inside a bracket; return whether there is one.

    YAML reads the rest of it as keys without values.
    """
    entries = node.entries
    for number, (key, value) in enumerate(entries):
        if not isinstance(value.value, str) or value.quoted or balance(value.value) <= 0:
            continue
        text = value.value
        for more, nothing in entries[number + 1 :]:
            if nothing.kind != "scalar" or nothing.value is not None or balance(text) <= 0:
                break
            text += f", {more.value}"
        if text != value.value:
            sentence = f"{value.value!r} has no end: YAML ends it at the comma"
            hint = f'put it in quotes: {key.value}: "{text}"'
            findings.error("E150", value.mark, sentence, hint)
            return True
    return False
