"""JSON Schemas of single values, from declarations.

Every schema is flat: a list of JSON types, and keywords that speak of one type each (`minimum` of
numbers, `pattern` of strings, `items` of lists). A validator then says what is wrong with a value
instead of "matches none of these", and a behaviour's ports and its bare value fit into one schema.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping, Sequence
from re import escape
from typing import Any

from missions.editor.markdown import declaration_text
from stack.parameters import REQUIRED, Declaration, declarations, has_fields, units
from stack.types import Assignments, Expression, Pose2D

Schema = dict[str, Any]

IDENTIFIER = "^[A-Za-z_][A-Za-z0-9_]*$"
REFERENCE = r"\$[A-Za-z_][A-Za-z0-9_]*"
SCALARS = ["string", "number", "boolean"]
_NUMBER = r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*"


def documented(schema: Schema, text: str) -> Schema:
    """The schema with a text that editors show."""
    return {**schema, "description": text.replace("*", ""), "markdownDescription": text}


def of_declaration(declared: Declaration, *, references: bool = True) -> Schema:
    """What may stand under a declared key.

    Args:
        declared: the port or parameter.
        references: whether `$name` may stand there as well.
    """
    schema = of_type(declared.type, declared, references=references)
    if isinstance(declared.default, bool | int | float | str) and declared.default is not REQUIRED:
        schema["default"] = declared.default
    return documented(schema, declaration_text(declared))


def of_type(kind: Any, declared: Declaration, *, references: bool = True) -> Schema:
    """What may be written for a type, within the declaration's unit and range."""
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        inner = next(arm for arm in typing.get_args(kind) if arm is not types.NoneType)
        schema = of_type(inner, declared, references=references)
        return {**schema, "type": [*schema["type"], "null"]} if "type" in schema else schema
    if has_fields(kind):
        fields = declarations(kind)
        return {
            **section({name: of_declaration(fields[name], references=False) for name in fields}),
            "type": ["object"],
        }
    if kind is Expression:
        return {"type": list(SCALARS)}
    if kind is Assignments:
        return assignments()
    if origin in (list, tuple):
        items = of_type(typing.get_args(kind)[0], declared, references=references)
        return _with_strings({"type": ["array"], "items": items}, [], references, declared)
    return _scalar(kind, declared, references)


def assignments() -> Schema:
    """Keys with expressions, as `set` takes them."""
    return {
        "type": "object", "minProperties": 1, "propertyNames": {"pattern": IDENTIFIER},
        "additionalProperties": {"type": list(SCALARS)},
    }  # fmt: skip


def words(options: Sequence[str], *more: str) -> Schema:
    """One of some words, or a text that fits one of the patterns."""
    fits = "|".join([*map(escape, options), *more])
    return {
        "type": "string", "pattern": f"^({fits})$", "examples": list(options),
        "patternErrorMessage": f"expected one of {', '.join(options)}",
    }  # fmt: skip


def section(properties: Mapping[str, Schema], required: Sequence[str] = ()) -> Schema:
    """A mapping with these keys and no others."""
    return {
        "type": "object", "properties": dict(properties), "additionalProperties": False,
        **({"required": list(required)} if required else {}),
    }  # fmt: skip


def named(schema: Schema) -> Schema:
    """A mapping whose keys are names."""
    return {
        "type": ["object", "null"],
        "propertyNames": {"pattern": IDENTIFIER},
        "additionalProperties": schema,
    }


def parts(declared: Sequence[Declaration], least: int | None = None) -> Schema:
    """A list with one item for each declaration; those after `least` may be left out."""
    return {
        "type": "array", "minItems": len(declared) if least is None else least,
        "maxItems": len(declared),
        "prefixItems": [of_declaration(part, references=False) for part in declared],
    }  # fmt: skip


POSE_PARTS = (
    Declaration("x", float, "map frame", "m"),
    Declaration("y", float, "map frame", "m"),
    Declaration("heading", float, "anticlockwise from the x axis", "rad"),
)


def pose() -> Schema:
    """`[x, y]` or `[x, y, heading]`."""
    return parts(POSE_PARTS, least=2)


def _scalar(kind: Any, declared: Declaration, references: bool) -> Schema:
    if kind is float:
        accepted = [_quantity(declared.unit)]
        return _with_strings({"type": ["number"], **_range(declared)}, accepted, references,
                             declared)  # fmt: skip
    if kind is int:
        return _with_strings({"type": ["integer"], **_range(declared)}, [], references, declared)
    if kind is bool:
        return _with_strings({"type": ["boolean"]}, [], references, declared)
    if kind is Pose2D:
        return _with_strings({**pose(), "type": ["array"]}, [], references, declared)
    if kind is str and declared.one_of:
        accepted = [escape(word) for word in declared.one_of]
        return {
            **_with_strings({"type": []}, accepted, references, declared),
            "examples": list(declared.one_of),
        }
    return {"type": ["string"]} if kind is str else {}


def _with_strings(
    schema: Schema, accepted: Sequence[str], references: bool, declared: Declaration
) -> Schema:
    """The schema with texts that fit one of some patterns, or are a `$name`."""
    patterns = [*accepted, *([REFERENCE] if references else [])]
    if not patterns:
        return schema
    wanted = " ".join(filter(None, [declared.type_name(), declared.range_text()]))
    return {
        **schema, "type": [*schema["type"], "string"], "pattern": f"^({'|'.join(patterns)})$",
        "patternErrorMessage": f"expected {wanted}" + (" or a $name" if references else ""),
    }  # fmt: skip


def _range(declared: Declaration) -> Schema:
    bounds = {
        "minimum": declared.at_least,
        "exclusiveMinimum": declared.above,
        "maximum": declared.at_most,
    }
    return {key: value for key, value in bounds.items() if value is not None}


def _quantity(unit: str) -> str:
    """The pattern of a number with a unit of this dimension."""
    fitting = [escape(word) for word, (dimension, _) in units().items() if dimension == unit]
    return f"{_NUMBER}({'|'.join(fitting)})?" if fitting else _NUMBER
