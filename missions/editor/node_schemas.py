"""JSON Schema of a node: one key that names its type, and modifiers."""

from __future__ import annotations

from collections.abc import Mapping
from re import escape

from behaviours.catalogue import BehaviourKind, Catalogue
from missions.editor.key_schemas import CHILDREN, TARGET, of_keys, of_section
from missions.editor.markdown import behaviour_text, word_text
from missions.editor.value_schemas import (
    COMPUTED,
    IDENTIFIER,
    Schema,
    documented,
    of_declaration,
    section,
)
from missions.language.keys import MODIFIERS
from missions.language.kinds import NODES
from missions.language.kinds.kind import Shape
from missions.language.reading.ports import bare_port
from missions.language.sections import ONLY_FOR, SECTIONS
from stack.parameters import Declaration
from stack.types import Assignments

DOTTED = r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)+$"
"""Dotted name of a py_trees class."""


def node_schema(catalogue: Catalogue) -> Schema:
    """Return the schema of a node of any installed type."""
    kinds = {word: documented(body, word_text(word)) for word, body in _bodies().items()}
    found = {name: catalogue.kinds[name] for name in catalogue.names()}
    kinds |= {
        name: documented(_body(kind.ports), behaviour_text(kind)) for name, kind in found.items()
    }
    alone = [name for name, kind in found.items() if not _required(kind)]
    pattern = "|".join([*map(escape, alone), DOTTED.strip("^$")])
    other_keys = {word: _other_keys(word, None) for word in NODES}
    other_keys |= {name: _other_keys(name, kind) for name, kind in found.items()}
    return {
        "type": ["string", "object"],
        "pattern": f"^({pattern})$",
        "patternErrorMessage": "expected a behaviour that needs no ports",
        "properties": {**kinds, **of_keys(MODIFIERS)},
        "patternProperties": {DOTTED: {}},
        "additionalProperties": False,
        "not": {"type": "object", "propertyNames": {"enum": list(MODIFIERS)}},
        "errorMessage": "a node is one key that names its type, with its ports as the value",
        "dependentSchemas": other_keys,
    }


def _required(kind: BehaviourKind) -> list[str]:
    return [name for name, declared in kind.ports.items() if declared.required]


def _body(declared: Mapping[str, Declaration]) -> Schema:
    """Return the schema of a behaviour's value: ports by name, a bare value, or nothing."""
    required = [name for name, port in declared.items() if port.required]
    ports = {name: of_declaration(port) for name, port in declared.items()}
    bare = bare_port(declared)
    if bare is not None and declared[bare].type is Assignments:
        return ports[bare]
    body = section(ports, required)
    accepted = ["object", *([] if required else ["null"])]
    if bare is None:
        return {**body, "type": accepted}
    value = {key: item for key, item in ports[bare].items() if "escription" not in key}
    value.pop("default", None)
    if "type" not in value:
        body.pop("type")
        return {**value, **body}
    return {**value, **body, "type": [*accepted, *value["type"]]}


def allowed_modifiers(word: str, kind: BehaviourKind | None) -> list[str]:
    """Return the modifiers allowed for a type; `kind` is set for a behaviour."""
    allowed = [name for name in MODIFIERS if word in ONLY_FOR.get(name, (word,))]
    takes_outputs = NODES[word].takes_outputs if word in NODES else kind and kind.outputs
    if not takes_outputs:
        allowed.remove("out")
    return allowed


def _other_keys(word: str, kind: BehaviourKind | None) -> Schema:
    """Return the schema of a node's other keys; it makes two types in one node an error."""
    schema: Schema = {"propertyNames": {"enum": [word, *allowed_modifiers(word, kind)]}}
    outputs = NODES[word].outputs if word in NODES else kind.outputs if kind else {}
    if outputs:
        targets = {name: documented(TARGET, declared.help) for name, declared in outputs.items()}
        schema["properties"] = {"out": section(targets)}
    if word in NODES and NODES[word].is_loop and not NODES[word].ports:
        schema["required"] = ["do"]
    return schema


def _bodies() -> dict[str, Schema]:
    """Return the schema of the value of each node kind besides behaviours."""
    found = {}
    for word, kind in NODES.items():
        if kind.ports:
            found[word] = _body(kind.ports)
        elif kind.shape is Shape.LOOP:
            found[word] = _LOOP
        elif kind.shape is Shape.TREE:
            found[word] = {"type": "string"}
        elif kind.shape is Shape.CASES:
            found[word] = of_section(SECTIONS[word])
        elif kind.shape is Shape.NOTHING:
            found[word] = {"type": ["array", "string"]}
        else:
            keys = of_section(kind.keys) | {"type": ["array", "object"]} if kind.keys else {}
            found[word] = {**CHILDREN, **keys}
    return found


_LOOP: Schema = {
    "type": "object", "minProperties": 1, "maxProperties": 1,
    "propertyNames": {"pattern": IDENTIFIER},
    "additionalProperties": {
        "type": ["array", "string"], "pattern": f"^{COMPUTED}$",
        "patternErrorMessage": "for_each takes a list or an expression",
    },
}  # fmt: skip
