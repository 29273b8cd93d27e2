"""Completion and hover inside expressions: names, fields of poses, robot values, functions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from missions.editor.names import Name
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES
from missions.language.expressions.texts import OPEN, has_placeholders
from missions.language.expressions.value_types import ANGLE, LENGTH, POSE, ValueType
from missions.language.reading.port_expressions import mentions_a_name

CLOSE = "}"
POSE_FIELDS: Mapping[str, ValueType] = {"x": LENGTH, "y": LENGTH, "heading": ANGLE}
OPERATORS = ("and", "or", "not", "is set")


@dataclass(frozen=True)
class ExpressionWord:
    """A word that can be used in an expression.

    Attributes:
        kind: as in completion: "name", "value", "function" or "keyword".
        after: text to insert after the word.
    """

    label: str
    kind: str
    detail: str = ""
    text: str = ""
    after: str = ""


def in_placeholder(before: str) -> bool:
    """Return whether the end of a text is inside a `${…}` that is not closed."""
    opened = before.rfind(OPEN)
    return opened >= 0 and before.find(CLOSE, opened) < 0 and before[opened - 1 : opened] != "$"


def word_in_expression(text: str) -> bool:
    """Return whether a value is an expression or a text with `${…}`."""
    return has_placeholders(text) or mentions_a_name(text)


def expression_words(names: Mapping[str, Name], *, plain: bool = False) -> Iterator[ExpressionWord]:
    """Yield the words of an expression.

    Args:
        names: the names in scope.
        plain: whether a name alone needs no `$`, as in `${visited}`.
    """
    for name in names.values():
        if plain:
            yield ExpressionWord(name.name, "name", f"{name.role}, {name.type}", f"`{name.text}`")
        yield reference_word(name)
    for word, value in ROBOT_VALUES.items():
        yield ExpressionWord(word, "value", str(value.type), value.help)
    yield from functions()
    yield from (ExpressionWord(word, "keyword") for word in OPERATORS)


def reference_word(name: Name) -> ExpressionWord:
    """Return a `$name` as a word."""
    return ExpressionWord(f"${name.name}", "name", f"{name.role}, {name.type}", f"`{name.text}`")


def functions() -> Iterator[ExpressionWord]:
    """Yield the functions."""
    for word, function in FUNCTIONS.items():
        yield ExpressionWord(word, "function", function.signature, function.help, "(")
    yield ExpressionWord(
        DISTANCE, "function", f"{DISTANCE}(place)", "distance from the robot to a pose", "("
    )


def fields(typed: str, names: Mapping[str, Name]) -> Iterator[ExpressionWord]:
    """Yield the fields of a `$name` of a pose that is being typed: `$dock.`."""
    name = names.get(typed.removeprefix("$").partition(".")[0])
    if name is not None and name.type == POSE:
        for field, kind in POSE_FIELDS.items():
            label = f"${name.name}.{field}"
            yield ExpressionWord(label, "value", str(kind), f"{field} of {name.name}, map frame")


def explained(word: str) -> str:
    """Return markdown about a robot value or a function; empty for any other word."""
    value, function = ROBOT_VALUES.get(word), FUNCTIONS.get(word)
    if function is not None:
        return f"**{function.signature}**: {function.help}\n\n*{function.result}*"
    if word == DISTANCE:
        return f"**{DISTANCE}(place)**: distance from the robot to a pose\n\n*{LENGTH}*"
    return f"**{word}**: {value.help}\n\n*{value.type}*" if value else ""


def explained_field(word: str, names: Mapping[str, Name]) -> str:
    """Return markdown about a field of a name: `$dock.x`."""
    name, _, field = word.removeprefix("$").partition(".")
    kind = POSE_FIELDS.get(field)
    if name not in names or kind is None:
        return ""
    return f"**${name}.{field}**: {field} of {name}, map frame\n\n*{kind}*"
