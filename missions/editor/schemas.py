"""`treepilot schema`: JSON Schemas as text."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from behaviours.catalogue import find_behaviours
from missions.editor.mission_schema import mission_schema
from stack.errors import InputError


def schema_text(kind: str, plugins: Sequence[str] = ()) -> str:
    """Return the JSON Schema of `mission`, `world`, `robot` or `markers` files.

    Args:
        kind: mission, world, robot or markers.
        plugins: plugins of missions to include, relative to the current folder.

    Raises:
        InputError: a plugin cannot be used.
    """
    if kind == "mission":
        catalogue = find_behaviours(plugins, Path.cwd())
        wrong = [f"{it.file}: {it.sentence}" for it in catalogue.problems if it.plugin >= 0]
        if wrong:
            raise InputError("\n".join(wrong))
        schema = mission_schema(catalogue)
    elif kind == "world":
        from missions.editor.world_schema import world_schema

        schema = world_schema()
    elif kind == "markers":
        from missions.editor.world_schema import marker_map_schema

        schema = marker_map_schema()
    else:
        from missions.editor.robot_schema import robot_schema

        schema = robot_schema()
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"
