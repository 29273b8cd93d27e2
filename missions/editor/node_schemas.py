"""JSON Schema of a node: one key that names its type, and modifiers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from re import escape

from behaviours.catalogue import BehaviourKind, Catalogue
from missions.editor.markdown import behaviour_text, word_text
from missions.editor.value_schemas import (
    IDENTIFIER,
    REFERENCE,
    SCALARS,
    Schema,
    documented,
    of_declaration,
    section,
    words,
)
from missions.language.reading.modifiers import (
    ATTEMPTS,
    DELAY,
    LIMIT,
    LOOPS,
    MODIFIERS,
    PERIOD,
    TIMES,
)
from missions.language.reading.nodes import COMPOSITES
from missions.language.reading.ports import bare_port
from missions.language.reading.waypoints import FOLLOW_WAYPOINTS, OUTPUTS, WAYPOINT_PORTS
from stack.parameters import Declaration
from stack.types import Assignments

NODE: Schema = {"$ref": "#/$defs/node"}
CHILDREN: Schema = {"type": "array", "minItems": 1, "items": NODE}
EXPRESSION: Schema = {"type": list(SCALARS)}
TARGET: Schema = {
    "type": "string", "pattern": f"^{REFERENCE}$",
    "patternErrorMessage": "an output goes to a blackboard key: $key",
}  # fmt: skip
DOTTED = r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)+$"
"""Dotted name of a py_trees class."""

_ONLY_FOR = {"with": ("use",), "do": LOOPS}
_WITH_OUTPUTS = ("use", FOLLOW_WAYPOINTS)


def node_schema(catalogue: Catalogue) -> Schema:
    """Return the schema of a node of any installed type."""
    kinds = {word: documented(body, word_text(word)) for word, body in _composites().items()}
    found = {name: catalogue.kinds[name] for name in catalogue.names()}
    kinds |= {
        name: documented(_body(kind.ports), behaviour_text(kind)) for name, kind in found.items()
    }
    alone = [name for name, kind in found.items() if not _required(kind)]
    pattern = "|".join([*map(escape, alone), DOTTED.strip("^$")])
    other_keys = {word: _other_keys(word, None) for word in COMPOSITES}
    other_keys |= {name: _other_keys(name, kind) for name, kind in found.items()}
    return {
        "type": ["string", "object"],
        "pattern": f"^({pattern})$",
        "patternErrorMessage": "expected a behaviour that needs no ports",
        "properties": {**kinds, **_modifiers()},
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
    allowed = [name for name in MODIFIERS if word in _ONLY_FOR.get(name, (word,))]
    if word not in _WITH_OUTPUTS and not (kind and kind.outputs):
        allowed.remove("out")
    return allowed


def _other_keys(word: str, kind: BehaviourKind | None) -> Schema:
    """Return the schema of a node's other keys; it makes two types in one node an error."""
    schema: Schema = {"propertyNames": {"enum": [word, *allowed_modifiers(word, kind)]}}
    outputs = OUTPUTS if word == FOLLOW_WAYPOINTS else kind.outputs if kind else {}
    if outputs:
        targets = {name: documented(TARGET, declared.help) for name, declared in outputs.items()}
        schema["properties"] = {"out": section(targets)}
    if word == "for_each":
        schema["required"] = ["do"]
    return schema


def _composites() -> dict[str, Schema]:
    others = ("use", "parallel", *LOOPS)
    lists = {word: CHILDREN for word in COMPOSITES if word not in others}
    succeed_on = {**words(["all", "one"]), "type": ["string", "integer"], "minimum": 1}
    both = section({"succeed_on": succeed_on, "do": CHILDREN}, ["do"])
    return {
        **lists,
        "parallel": {**both, **CHILDREN, "type": ["array", "object"]},
        "for_each": {
            "type": "object", "minProperties": 1, "maxProperties": 1,
            "propertyNames": {"pattern": IDENTIFIER},
            "additionalProperties": {
                "type": ["array", "string"], "pattern": f"^{REFERENCE}$",
                "patternErrorMessage": "for_each takes a list or a $name",
            },
        },
        FOLLOW_WAYPOINTS: _body(WAYPOINT_PORTS),
        "use": {"type": "string"},
    }  # fmt: skip


def _modifiers() -> dict[str, Schema]:
    attempts = of_declaration(ATTEMPTS)
    retry = section({"attempts": attempts, "delay": of_declaration(DELAY)}, ["attempts"])
    recover = {"attempts": attempts, "unless": EXPRESSION, "round_robin": CHILDREN}
    schemas: dict[str, Schema] = {
        "name": {"type": "string", "minLength": 1},
        "when": EXPRESSION,
        "while": EXPRESSION,
        "on_failure": {"enum": ["continue", "fail"]},
        "repeat": {
            **of_declaration(TIMES),
            **words(["forever"], REFERENCE), "type": ["integer", "string"],
        },
        "recover": section(recover, ["attempts", "round_robin"]),
        "retry": {**of_declaration(replace(ATTEMPTS, name="retry")), **retry,
                  "type": ["integer", "string", "object"]},
        "timeout": of_declaration(LIMIT),
        "every": of_declaration(PERIOD),
        "with": {"type": ["object", "null"]},
        "out": {"type": "object", "additionalProperties": TARGET},
        "do": NODE,
    }  # fmt: skip
    return {word: documented(schemas.get(word, {}), word_text(word)) for word in MODIFIERS}
