"""Reader of literals at ports: `1.5 m`, `[dock, desk]`, `true`."""

from __future__ import annotations

import re
from math import pi

from missions.language.expressions.expression import NameContext
from missions.language.reading.port_expressions import REFERENCE, text_of, within
from missions.language.values import Constant
from stack.documents import Findings, Mark, Node, iter_scalars
from stack.errors import Hint, ParameterError
from stack.parameters import Declaration

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def read_literal(
    declared: Declaration, node: Node, context: NameContext, findings: Findings
) -> Constant | None:
    """Return the checked literal of a port; None after a finding.

    Args:
        declared: the port.
        node: its value.
        context: the visible names, for hints about a missing `$`.
        findings: receive what is wrong.
    """
    for scalar in iter_scalars(node):
        _warn_of_reference_in_text(scalar, context, findings)
    try:
        value = declared.read(node.plain())
        _refuse_degrees(declared, node)
        return Constant(value, text_of(node), node.mark, marks_of(node))
    except ParameterError as error:
        hint = _reference_hint(node, context) or error.hint
        findings.add("E132", node.mark, f"{declared.name}: {error.sentence}", hint)
    return None


def _warn_of_reference_in_text(scalar: Node, context: NameContext, findings: Findings) -> None:
    if not isinstance(scalar.value, str) or scalar.quoted:
        return
    inside = REFERENCE.search(scalar.value)
    if inside and context.scope.lookup(inside[1]):
        sentence = f"{inside[0]} inside a text is not replaced by its value"
        hint = f"write ${{{inside[1]}}}, or quote the text"
        findings.add("W104", within(scalar, inside.start()), sentence, hint)


def write_name(word: str) -> Hint:
    """Return the hint for a name without its `$`."""
    return Hint(f"write ${word}", f"${word}")


def marks_of(node: Node) -> tuple[Mark, ...]:
    """Return the positions of the items of a list."""
    return tuple(item.mark for item in node.items)


def _refuse_degrees(declared: Declaration, node: Node) -> None:
    """Raise ParameterError for a bare angle of more than a full turn: almost certainly degrees."""
    if declared.unit != "rad":
        return
    for item in node.items or (node,):
        angle = item.value
        is_bare = isinstance(angle, int | float) and not isinstance(angle, bool)
        if is_bare and abs(angle) > 2.0 * pi + 1e-9:
            sentence = f"an angle of {angle:g} rad is more than a full turn"
            hint = f"write {angle:g} deg, or {angle:g} rad"
            fixed = "" if node.items else f"{angle:g} deg"
            raise ParameterError(declared.name, sentence, Hint(hint, fixed))


def _reference_hint(node: Node, context: NameContext) -> str:
    """Return a hint if a value contains a name without its `$`."""
    words = IDENTIFIER.findall(node.value) if isinstance(node.value, str) else []
    known = next((word for word in words if context.scope.lookup(word)), "")
    if known and re.fullmatch(rf"[^\w\s]*\s*{known}\s*[^\w\s]*", str(node.value)):
        return write_name(known)  # also `{{ name }}` and `<name>`, and a `$name` in quotes
    return f"write ${known}" if known else ""
