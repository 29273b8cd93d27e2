"""JSON Schemas of the keys of mission files, from the table of keys."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from missions.editor.component_schemas import component_schema, navigation
from missions.editor.value_schemas import (
    COMPUTED,
    REFERENCE,
    SCALARS,
    Schema,
    documented,
    named,
    of_declaration,
    pose,
    section,
    words,
)
from missions.language.expressions.value_types import NAMED
from missions.language.keys import ANY_KEY, Form, Key, Keys, required
from missions.language.reading.header import FORMAT
from missions.language.sections import SECTIONS

NODE: Schema = {"$ref": "#/$defs/node"}
CHILDREN: Schema = {"type": "array", "minItems": 1, "items": NODE}
EXPRESSION: Schema = {"type": list(SCALARS)}
TEXT: Schema = {"type": "string"}
NAME: Schema = {"type": "string", "minLength": 1}
TEXTS: Schema = {"type": "array", "items": NAME}
TARGET: Schema = {
    "type": "string", "pattern": f"^{REFERENCE}$",
    "patternErrorMessage": "an output goes to a blackboard key: $key",
}  # fmt: skip


def of_section(keys: Keys) -> Schema:
    """Return the schema of a mapping with these keys."""
    schema = section(of_keys(keys), required(keys))
    if ANY_KEY in keys:
        schema.pop("additionalProperties")
    return schema


def of_keys(keys: Keys) -> dict[str, Schema]:
    """Return the schema of each key."""
    return {word: of_key(key) for word, key in keys.items() if word != ANY_KEY}


def of_key(key: Key) -> Schema:
    """Return the schema of the value of a key."""
    return documented(_FORMS[key.form](key), key.doc)


def type_word() -> Schema:
    """Return the schema of the name of a type."""
    return {
        **words(list(NAMED)), "pattern": rf"^\s*(list\s+of\s+)*({'|'.join(NAMED)})\s*$",
        "patternErrorMessage": f"a type is {', '.join(NAMED)}, or `list of` one of them",
    }  # fmt: skip


def mapping(schema: Schema) -> Schema:
    """Return the schema of a mapping with any keys."""
    return {"type": ["object", "null"], "additionalProperties": schema}


def _value(key: Key, *, references: bool = True) -> Schema:
    assert key.declared is not None
    schema = of_declaration(key.declared, references=references)
    if not key.words:
        return schema
    pattern = (COMPUTED,) if references else ()
    return {**schema, **words(list(key.words), *pattern), "type": [*_types(schema), "string"]}


def _types(schema: Schema) -> list[str]:
    kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return [kind for kind in kinds if kind != "string"]


def _sectioned(key: Key) -> Schema:
    """Return the schema of a section that may also be written as one value."""
    inner = of_section(SECTIONS[key.section])
    if key.declared is None:
        return inner
    bare = {**_value(key), "default": None}
    bare.pop("default")
    return {**bare, **inner, "type": [*_types(bare), "string", "object"]}


def _inputs(key: Key) -> Schema:
    inner = of_section(SECTIONS[key.section])
    return named({**inner, **type_word(), "type": ["string", "object"]})


def _named_list(key: Key) -> Schema:
    one = {**named(of_section(SECTIONS[key.section])), "type": "object",
           "minProperties": 1, "maxProperties": 1}  # fmt: skip
    return {"type": ["array", "null"], "items": one}


def _listed(key: Key, more: str) -> Schema:
    """Return the schema of one duration, or of several in a list or mapping."""
    duration = _value(key, references=False)
    return {**duration, "type": [*duration["type"], more]}


def _mocks(key: Key) -> Schema:
    one = of_section(SECTIONS[key.section])
    return mapping({**one, "type": ["string", "array", "object"]})


def _place(key: Key) -> Schema:
    examples: Mapping[str, Any] = {"examples": list(key.words)} if key.words else {}
    return {**pose(), "type": ["array", "string"], **examples}


def _file(key: Key) -> Schema:
    return {**TEXT, "examples": list(key.words), "default": key.words[0]} if key.words else TEXT


_COUNT: Schema = {"type": ["integer", "array"], "minimum": 0, "minItems": 1, "maxItems": 2}
_FORMS: dict[Form, Callable[[Key], Schema]] = {
    Form.TEXT: lambda key: TEXT, Form.NAME: lambda key: NAME,
    Form.TEXTS: lambda key: {"type": "array", "minItems": 1},
    Form.NUMBER: lambda key: {"enum": [FORMAT]},
    Form.WORD: lambda key: {"enum": list(key.words)}, Form.VALUE: _value,
    Form.LITERAL: lambda key: _value(key, references=False), Form.ANY: lambda key: {},
    Form.RANGE: lambda key: {"type": "array", "minItems": 2, "maxItems": 2},
    Form.TYPE: lambda key: type_word(), Form.TYPES: lambda key: named(type_word()),
    Form.INPUTS: _inputs, Form.EXPRESSION: lambda key: EXPRESSION,
    Form.NODE: lambda key: NODE, Form.NODES: lambda key: CHILDREN,
    Form.PLACE: _place, Form.POSES: lambda key: named(pose()),
    Form.CASES: lambda key: mapping(NODE),
    Form.FILE: _file, Form.FILES: lambda key: TEXTS,
    Form.ROBOT: lambda key: {**of_section(SECTIONS[key.section]), **NAME,
                             "type": ["string", "object"]},
    Form.WORLD: lambda key: NAME,
    Form.COMPONENT: lambda key: component_schema(key.word),
    Form.COMPONENTS: lambda key: navigation(), Form.SECTION: _sectioned,
    Form.NAMED: lambda key: named(of_section(SECTIONS[key.section])),
    Form.NAMED_LIST: _named_list,
    Form.LIST: lambda key: {"type": "array", "items": of_section(SECTIONS[key.section])},
    Form.OUTCOMES: lambda key: {"type": ["string", "array"]},
    Form.DURATIONS: lambda key: _listed(key, "array"),
    Form.DURATION_OF: lambda key: _listed(key, "object"),
    Form.COUNTS: lambda key: mapping(_COUNT),
    Form.NODE_NAMES: lambda key: {"type": ["array", "string"]}, Form.MOCKS: _mocks,
    Form.ARGUMENTS: lambda key: {"type": "object"},
    Form.CHANGES: lambda key: mapping({"type": "object"}),
    Form.INPUT_VALUES: lambda key: {"type": ["object", "null"]},
    Form.TARGETS: lambda key: {"type": "object", "additionalProperties": TARGET},
    Form.OUTPUT_VALUES: lambda key: {"type": "object"}, Form.CODE: lambda key: TEXT,
}  # fmt: skip
