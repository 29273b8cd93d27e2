"""JSON Schemas of single values, from declarations.

Every schema is flat: a list of JSON types, and keywords that apply to one type each (`minimum` to
numbers, `pattern` to strings, `items` to lists). A validator can then state the error of a value
instead of "matches none of these", and one schema covers a behaviour's ports and its bare value.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Mapping, Sequence
from re import escape
from typing import Any

from missions.editor.markdown import declaration_text
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES
from stack.parameters import REQUIRED, Declaration, declarations, has_fields, units
from stack.types import Assignments, Expression, Path, Pose2D

Schema = dict[str, Any]

IDENTIFIER = "^[A-Za-z_][A-Za-z0-9_]*$"
REFERENCE = r"\$[A-Za-z_][A-Za-z0-9_]*"
_NAMES = [*map(escape, (*ROBOT_VALUES, DISTANCE)), *(rf"{word}\(" for word in FUNCTIONS)]
COMPUTED = rf".*(\$[A-Za-z_]|{'|'.join(_NAMES)}).*"
"""A text with a `$name`, a value of the robot or a function."""
SCALARS = ["string", "number", "boolean"]
_NUMBER = r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*"


def documented(schema: Schema, text: str) -> Schema:
    """Return the schema with a description for editors."""
    return {**schema, "description": text.replace("*", ""), "markdownDescription": text}


def of_declaration(declared: Declaration, *, references: bool = True) -> Schema:
    """Return the schema of a declared key's value.

    Args:
        declared: the port or parameter.
        references: whether `$name` is also allowed.
    """
    schema = of_type(declared.type, declared, references=references)
    if isinstance(declared.default, bool | int | float | str) and declared.default is not REQUIRED:
        schema["default"] = declared.default
    return documented(schema, declaration_text(declared))


def of_type(kind: Any, declared: Declaration, *, references: bool = True) -> Schema:
    """Return the schema of a type, within the declaration's unit and range."""
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
    """Return the schema of keys with expressions, as in `set`."""
    return {
        "type": "object", "minProperties": 1, "propertyNames": {"pattern": IDENTIFIER},
        "additionalProperties": {"type": [*SCALARS, "array"]},
    }  # fmt: skip


def words(options: Sequence[str], *more: str) -> Schema:
    """Return the schema of one of several words, or a text that matches one of the patterns."""
    alternatives = "|".join([*map(escape, options), *more])
    return {
        "type": "string", "pattern": f"^({alternatives})$", "examples": list(options),
        "patternErrorMessage": f"expected one of {', '.join(options)}",
    }  # fmt: skip


def section(properties: Mapping[str, Schema], required: Sequence[str] = ()) -> Schema:
    """Return the schema of a mapping with these keys and no others."""
    return {
        "type": "object", "properties": dict(properties), "additionalProperties": False,
        **({"required": list(required)} if required else {}),
    }  # fmt: skip


def named(schema: Schema) -> Schema:
    """Return the schema of a mapping whose keys are names."""
    return {
        "type": ["object", "null"],
        "propertyNames": {"pattern": IDENTIFIER},
        "additionalProperties": schema,
    }


def parts(
    declared: Sequence[Declaration], least: int | None = None, *, references: bool = False
) -> Schema:
    """Return the schema of a list, one item per declaration; those after `least` are optional."""
    return {
        "type": "array", "minItems": len(declared) if least is None else least,
        "maxItems": len(declared),
        "prefixItems": [of_declaration(part, references=references) for part in declared],
    }  # fmt: skip


POSE_PARTS = (
    Declaration("x", float, "map frame", "m"),
    Declaration("y", float, "map frame", "m"),
    Declaration("heading", float, "anticlockwise from the x axis", "rad"),
)


def pose(*, references: bool = False) -> Schema:
    """Return the schema of `[x, y]` or `[x, y, heading]`; with `references`, of expressions."""
    return parts(POSE_PARTS, least=2, references=references)


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
        return _with_strings(
            {**pose(references=references), "type": ["array"]}, [], references, declared
        )
    if kind is Path:
        poses = {"type": ["array"], "items": pose(), "minItems": 2}
        return _with_strings(poses, [], references, declared)
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
    """Return the schema extended by texts that match one of the patterns, or a `$name`."""
    words = REFERENCE if declared.one_of else COMPUTED
    patterns = [*accepted, *([words] if references else [])]
    if not patterns:
        return schema
    wanted = " ".join(filter(None, [declared.type_name(), declared.range_text()]))
    return {
        **schema, "type": [*schema["type"], "string"], "pattern": f"^({'|'.join(patterns)})$",
        "patternErrorMessage": f"expected {wanted}" + (" or an expression" if references else ""),
    }  # fmt: skip


def _range(declared: Declaration) -> Schema:
    bounds = {
        "minimum": declared.at_least,
        "exclusiveMinimum": declared.above,
        "maximum": declared.at_most,
    }
    return {key: value for key, value in bounds.items() if value is not None}


def _quantity(unit: str) -> str:
    """Return the pattern of a number with a unit of this dimension."""
    known = [escape(word) for word, (dimension, _) in units().items() if dimension == unit]
    return f"{_NUMBER}({'|'.join(known)})?" if known else _NUMBER
