"""JSON Schemas of components of navigation and localisation, and of their settings."""

from __future__ import annotations

from missions.editor.value_schemas import Schema, documented, of_declaration, section
from missions.execution.component_choices import MAPLESS_DEFAULTS, SETTINGS
from missions.language.reading.header import NAV2, TOP_COMPONENTS
from stack.components import DEFAULTS, GROUPS, available, component, noun
from stack.costmap.choosing import COSTMAPS, SENSORS
from stack.errors import InputError
from stack.parameters import declarations

TEXT: Schema = {"type": "string"}


def navigation() -> Schema:
    kinds = {kind: component_schema(kind) for kind in DEFAULTS if kind not in TOP_COMPONENTS}
    for kind, settings in SETTINGS.items():
        fields = _fields(settings)
        if kind == "costmap" and "costmap_layer" in GROUPS:
            fields["layers"] = _layers()
        if kind == "safety":
            fields["zones"] = documented({"type": "array"}, "Zones of the collision monitor.")
        kinds[kind] = documented(section(fields), f"Settings of the {kind}.")
    file = documented(TEXT, "The parameter file.")
    namespace = documented(TEXT, "Namespace of the robot, in a file with several.")
    one_of_several = {**section({"file": file, "namespace": namespace}), "required": ["file"]}
    kinds[NAV2] = documented({"anyOf": [TEXT, one_of_several]}, "Nav2 parameter file to import.")
    return {**section(kinds), "type": ["object", "null"]}


def _layers() -> Schema:
    """Layers by name or with parameters, in the order in which they are applied."""
    names = [*available("costmap_layer"), SENSORS]
    words = {
        "use": {"type": "string", "examples": names},
        "name": documented(TEXT, "Name of the layer; default: the name of the component."),
        "only": documented({"enum": list(COSTMAPS)}, "The costmap that uses the layer."),
        "inflated": documented({"type": "boolean"}, "Whether its lethal cells are inflated."),
    }
    layer = {"type": ["string", "object"], "examples": names, "required": ["use"],
             "properties": words}  # fmt: skip
    return documented({"type": "array", "items": layer}, "Layers, in the order of application.")


def component_schema(kind: str) -> Schema:
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
