"""JSON Schema (draft 2020-12) of mission files, from the table of keys and the behaviours."""

from __future__ import annotations

from behaviours.catalogue import Catalogue
from missions.editor.key_schemas import of_section
from missions.editor.node_schemas import node_schema
from missions.editor.value_schemas import Schema
from missions.language.keys import MISSION

DRAFT = "https://json-schema.org/draft/2020-12/schema"


def mission_schema(catalogue: Catalogue) -> Schema:
    """Return the schema of missions that use these behaviours.

    It checks single values. Names, data flow and the ranges of quantities with a unit are checked
    by `treepilot check` and the language server only.
    """
    return {
        "$schema": DRAFT,
        "title": "treepilot mission, format 1",
        **of_section(MISSION),
        "$defs": {"node": node_schema(catalogue)},
    }
