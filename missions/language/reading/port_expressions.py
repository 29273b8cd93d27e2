"""Recognises expressions among the values of ports: `wait: $n * 2 s`.

A value is an expression if its port has another type than text and it contains a `$name`, a value
of the robot or a function. No literal of these types contains one, so a valid literal keeps its
meaning. A text port stays a text with `${…}`.
"""

from __future__ import annotations

import re
from itertools import pairwise

from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.grammar import parse
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES
from missions.language.expressions.texts import has_placeholders
from missions.language.expressions.tokens import ExpressionError, Token, tokens
from missions.language.expressions.value_types import BOOL, INT, POSE, ValueType
from stack.documents import Mark, Node

REFERENCE = re.compile(r"\$([A-Za-z_]\w*)")


def reference_name(node: Node) -> str | None:
    """Return the name if the node is an unquoted `$name`."""
    if node.quoted or not isinstance(node.value, str):
        return None
    found = REFERENCE.fullmatch(node.value)
    return found[1] if found else None


def text_of(node: Node) -> str:
    """Return a literal in one line as written, for drawings of the tree."""
    if node.is_sequence:
        return f"[{', '.join(text_of(item) for item in node.items)}]"
    if node.is_mapping:
        pairs = (f"{key.value}: {text_of(value)}" for key, value in node.entries)
        return f"{{{', '.join(pairs)}}}"
    if isinstance(node.value, bool):
        return "true" if node.value else "false"
    return str(node.value)


def computed_source(node: Node, kind: ValueType) -> str | None:
    """Return the expression that a port's value is; None if it is a literal."""
    if kind.item is None and kind not in (BOOL, INT, POSE) and kind.of is not float:
        return None
    if kind == POSE and node.is_sequence and len(node.items) in (2, 3):
        parts = [item for item in node.items if item.kind == "scalar"]
        computed = any(
            isinstance(part.value, str) and mentions_a_name(part.value) for part in parts
        )
        return pose_source(node) if computed and len(parts) == len(node.items) else None
    if node.kind != "scalar" or not isinstance(node.value, str):
        return None
    if node.quoted and REFERENCE.fullmatch(node.value):
        return None
    return node.value if mentions_a_name(node.value) else None


def pose_source(node: Node) -> str:
    """Return the expression of a pose written as a list: `[$x + 1 m, $y, 90 deg]`."""
    return f"pose({', '.join(text_of(item) for item in node.items)})"


def list_source(node: Node, kind: ValueType) -> str:
    """Return the expression of a value of this type that is written as a list."""
    if not node.is_sequence:
        return text_of(node)
    if kind == POSE and len(node.items) in (2, 3):
        return pose_source(node)
    return f"[{', '.join(list_source(item, kind.item or kind) for item in node.items)}]"


def mentions_a_name(text: str) -> bool:
    """Return whether a text contains a `$name`, a value of the robot or a function."""
    try:
        words = tokens(text)
    except ExpressionError:
        return REFERENCE.search(text) is not None
    return any(_is_name(word, after, len(words) > 2) for word, after in pairwise(words))


def _is_name(word: Token, after: Token, is_compound: bool) -> bool:
    if word.kind == "reference":
        return True
    if word.kind != "name":
        return False
    if after.text == "(" and after.kind == "operator":
        return word.text in FUNCTIONS or word.text == DISTANCE
    return word.text in ROBOT_VALUES or ("." in word.text and is_compound)


def is_text_with_placeholders(node: Node) -> bool:
    """Return whether the value of an assignment is a text with `${…}` and not an expression.

    `'a ${n}'` in quotes inside an expression is a literal.
    """
    if not isinstance(node.value, str) or not has_placeholders(node.value):
        return False
    try:
        parse(node.value)
    except ExpressionError:
        return True
    return False


def written_as(source: str, node: Node) -> Node:
    """Return a scalar in place of a list of expressions, at its position."""
    folded = any(item.folded or item.mark.line != node.mark.line for item in node.items)
    return Node(source, "scalar", node.mark, folded=folded)


def within(node: Node, offset: int) -> Mark:
    """Return the position of an offset in a one-line scalar, else the scalar's position."""
    if not isinstance(node.value, str) or "\n" in node.value or node.folded:
        return node.mark
    return Mark(node.mark.file, node.mark.line, node.mark.column + offset + node.quoted)
