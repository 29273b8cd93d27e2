"""JSON Schema (draft 2020-12) of mission files, derived from the installed behaviours."""

from __future__ import annotations

from behaviours.catalogue import Catalogue
from missions.editor.markdown import TOP_KEYS, TREE_KEYS
from missions.editor.node_schemas import EXPRESSION, NODE, node_schema
from missions.editor.value_schemas import (
    Schema,
    documented,
    named,
    of_declaration,
    pose,
    section,
    words,
)
from missions.execution.component_choices import DEFAULTS, MAPLESS_DEFAULTS, SETTINGS
from missions.language.expressions.value_types import NAMED
from missions.language.reading.cases import CASE_KEYS, EXPECT_KEYS
from missions.language.reading.events import EVENT_KEYS, HOLD, THEN
from missions.language.reading.header import LOCALISATION
from stack.components import GROUPS, available, component, noun
from stack.costmap.choosing import COSTMAPS
from stack.errors import InputError
from stack.parameters import Declaration, declarations

DRAFT = "https://json-schema.org/draft/2020-12/schema"
TEXT: Schema = {"type": "string"}
TEXTS: Schema = {"type": "array", "items": {"type": "string", "minLength": 1}}
DURATION = Declaration("", float, unit="s", at_least=0.0)


def mission_schema(catalogue: Catalogue) -> Schema:
    """Return the schema of missions that use these behaviours.

    It checks single values. Names, data flow and the ranges of quantities with a unit are checked
    by `treepilot check` and the language server only.
    """
    keys: dict[str, Schema] = {
        "mission": {"type": "string", "minLength": 1}, "format": {"enum": [1]}, "doc": TEXT,
        "robot": {"type": "string", "minLength": 1}, "world": {"type": "string", "minLength": 1},
        "start": _pose_or_place(), "initial_pose": _pose_or_place("start", "unknown"),
        "map": {**TEXT, "examples": ["from_world", "none"], "default": "from_world"},
        "places": named(pose()), "parameters": TEXTS, "navigation": _navigation(),
        "localisation": _component(LOCALISATION),
        "plugins": TEXTS, "include": TEXTS, "arguments": named(_argument()),
        "blackboard": named(_key()), "events": _events(), "run": NODE,
        "trees": named(_tree()), "tests": {"type": "array", "items": _test()},
    }  # fmt: skip
    described: dict[str, Schema] = {
        key: documented(keys[key], text) for key, text in TOP_KEYS.items()
    }
    return {
        "$schema": DRAFT,
        "title": "treepilot mission, format 1",
        **section(described, ["mission", "robot", "world", "run"]),
        "$defs": {"node": node_schema(catalogue)},
    }


def _pose_or_place(*other: str) -> Schema:
    return {**pose(), "type": ["array", "string"], **({"examples": list(other)} if other else {})}


def _type_word() -> Schema:
    return {
        **words(list(NAMED)), "pattern": rf"^\s*(list\s+of\s+)*({'|'.join(NAMED)})\s*$",
        "patternErrorMessage": f"a type is {', '.join(NAMED)}, or `list of` one of them",
    }  # fmt: skip


def _argument() -> Schema:
    return section({
        "type": documented(_type_word(), "The type of its values."),
        "default": documented({}, "Value without `--set`."),
        "range": documented(
            {"type": "array", "minItems": 2, "maxItems": 2}, "`[minimum, maximum]` of a number."),
        "one_of": documented(
            {"type": "array", "minItems": 1}, "Allowed texts."),
        "unit": documented(TEXT, "SI unit, for `type: float`."),
        "doc": documented(TEXT, "Description."),
    }, ["type"])  # fmt: skip


def _key() -> Schema:
    return section({
        "type": documented(_type_word(), "The type of its values."),
        "initial": documented({}, "Value at the start of the mission."),
        "optional": documented(
            {"type": "boolean"}, "Whether it can be unset; test with `$key is set`."),
        "unit": documented(TEXT, "SI unit, for `type: float`."),
        "doc": documented(TEXT, "Description."),
    }, ["type"])  # fmt: skip


def _tree() -> Schema:
    detailed = section({
        "type": documented(_type_word(), "Type of the input."),
        "default": documented({}, "Value if `with` does not set the input."),
        "unit": documented(TEXT, "SI unit, for `type: float`."),
        "doc": documented(TEXT, "Description."),
    }, ["type"])  # fmt: skip
    inputs = named({**detailed, **_type_word(), "type": ["string", "object"]})
    keys = {"in": inputs, "out": named(_type_word()), "doc": TEXT, "do": NODE}
    return section({key: documented(keys[key], text) for key, text in TREE_KEYS.items()}, ["do"])


def _events() -> Schema:
    keys = {
        "when": EXPRESSION, "hold": of_declaration(HOLD), "do": NODE,
        "then": {"enum": list(THEN)},
    }  # fmt: skip
    event = section({key: documented(keys[key], text) for key, text in EVENT_KEYS.items()},
                    ["when", "do"])  # fmt: skip
    one = {**named(event), "type": "object", "minProperties": 1, "maxProperties": 1}
    return {"type": ["array", "null"], "items": one}


def _test() -> Schema:
    """A case under `tests`."""
    duration = of_declaration(DURATION, references=False)
    outcome: Schema = {"type": ["string", "array"]}
    takes = {**duration, "type": [*duration["type"], "array"]}
    mock = section({"returns": outcome, "takes": takes, "sets": {"type": "object"}})
    keys: dict[str, Schema] = {
        "name": {"type": "string", "minLength": 1},
        "arguments": {"type": "object"},
        "mock": _mapping({**mock, **outcome, "type": ["string", "array", "object"]}),
        "at": _mapping({"type": "object"}),
        "expect": _expectation(duration),
    }
    return section({key: documented(keys[key], text) for key, text in CASE_KEYS.items()})


def _expectation(duration: Schema) -> Schema:
    count = {"type": ["integer", "array"], "minimum": 0, "minItems": 1, "maxItems": 2}
    keys = {
        "status": {"enum": ["success", "failure", "running"]}, "failure": TEXT,
        "ran": _mapping(count), "order": {"type": ["array", "string"]},
        "within": {**duration, "type": [*duration["type"], "object"]},
    }  # fmt: skip
    return {
        "type": "object",
        "properties": {key: documented(keys[key], EXPECT_KEYS[key]) for key in keys},
    }


def _mapping(schema: Schema) -> Schema:
    return {"type": ["object", "null"], "additionalProperties": schema}


def _navigation() -> Schema:
    kinds = {kind: _component(kind) for kind in DEFAULTS if kind != LOCALISATION}
    for kind, settings in SETTINGS.items():
        fields = _fields(settings)
        if kind == "costmap" and "costmap_layer" in GROUPS:
            fields["layers"] = _layers()
        if kind == "safety":
            fields["zones"] = documented({"type": "array"}, "Zones of the collision monitor.")
        kinds[kind] = documented(section(fields), f"Settings of the {kind}.")
    kinds["nav2_params"] = documented({"type": "string"}, "Nav2 parameter file to import.")
    return {**section(kinds), "type": ["object", "null"]}


def _layers() -> Schema:
    """Layers by name or with parameters, in the order in which they are applied."""
    names = list(available("costmap_layer"))
    words = {
        "use": {"type": "string", "examples": names},
        "name": documented(TEXT, "Name of the layer; default: the name of the component."),
        "only": documented({"enum": list(COSTMAPS)}, "The costmap that uses the layer."),
        "inflated": documented({"type": "boolean"}, "Whether its lethal cells are inflated."),
    }
    layer = {"type": ["string", "object"], "examples": names, "required": ["use"],
             "properties": words}  # fmt: skip
    return documented({"type": "array", "items": layer}, "Layers, in the order of application.")


def _component(kind: str) -> Schema:
    """A component by name, or with parameters, which depend on the name.

    Where the default depends on the map, parameters without `use` are not checked.
    """
    names, default = list(available(kind)), DEFAULTS[kind]
    certain = "use" not in MAPLESS_DEFAULTS.get(kind, {})
    parameters = {name: _parameters(kind, name) for name in names}
    known = [
        {
            "if": {"type": "object", "properties": {"use": {"const": name}},
                   **({} if name == default and certain else {"required": ["use"]})},
            "then": {"properties": fields,
                     "propertyNames": {"enum": ["use", *fields]}},
        }
        for name, fields in parameters.items() if fields is not None
    ]  # fmt: skip
    use = {"type": "string", "examples": names, "default": default}
    schema = {
        "type": ["string", "object"], "examples": names, "properties": {"use": use}, "allOf": known,
    }  # fmt: skip
    return documented(schema, f"The {noun(kind)}: {', '.join(f'`{name}`' for name in names)}.")


def _parameters(kind: str, name: str) -> dict[str, Schema] | None:
    """Return the parameters of a component; None if it is installed but cannot be loaded."""
    try:
        return _fields(component(kind, name).Parameters)  # type: ignore[attr-defined]
    except InputError:
        return None


def _fields(parameters: type) -> dict[str, Schema]:
    return {
        name: of_declaration(declared, references=False)
        for name, declared in declarations(parameters).items()
    }
