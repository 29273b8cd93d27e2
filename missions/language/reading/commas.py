"""Values without quotes that YAML ends at a comma: `{set: {l: append($l, 1)}}`, `{wait: 0,5}`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from missions.language.expressions.tokens import balance
from stack.documents import Findings, Node


def report_cut_expression(node: Node, findings: Findings) -> bool:
    """Report the first value of a mapping that ends inside a bracket; return whether there is one.

    YAML reads the rest of it as keys without values.
    """
    entries = node.entries
    for number, (key, value) in enumerate(entries):
        if _ends_at_a_decimal_comma(value, entries[number + 1 :]):
            rest = str(entries[number + 1][0].value)
            sentence = f"YAML ends {value.value} at the comma"
            hint = f"write {value.value}.{rest}, or [{value.value}, {rest}] for two numbers"
            findings.add("E132", value.mark, sentence, hint)
            return True
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
            findings.add("E150", value.mark, sentence, hint)
            return True
    return False


def _ends_at_a_decimal_comma(value: Node, after: Sequence[tuple[Node, Node]]) -> bool:
    """Return whether a number is followed by a number as a key without a value: `0,5`."""
    if not after or not isinstance(value.value, int) or isinstance(value.value, bool):
        return False
    key, nothing = after[0]
    begins_with_digit = re.match(r"-?\d", str(key.value)) is not None
    return begins_with_digit and nothing.kind == "scalar" and nothing.value is None
