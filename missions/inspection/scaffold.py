"""Writes the beginnings of a new planner, controller or costmap layer, and its test.

What is written stands in missions/templates; behaviours have behaviours.scaffold.
"""

from __future__ import annotations

from pathlib import Path
from string import Template

from behaviours.scaffold import check_name, write_new
from stack.components import GROUPS, available
from stack.errors import InputError

TEMPLATES = Path(__file__).parent / "templates"
KINDS = {"planner": "planner", "controller": "controller", "layer": "costmap_layer"}
"""What `treepilot new` calls a kind of component, and what the stack calls it."""


def new_component(kind: str, name: str, folder: Path) -> list[Path]:
    """Write `<name>.py` and `test_<name>.py` into a plugin folder, made if need be.

    Args:
        kind: planner, controller or layer.
        name: as a mission will write it, e.g. straight_line.
        folder: where plugins are; a mission names it under `plugins`.

    Returns:
        The files written.

    Raises:
        InputError: the name will not do, or a file of that name is there already.
    """
    check_name(name, f"a {kind}")
    taken = available(KINDS[kind]) if KINDS[kind] in GROUPS else {}
    if name in taken:
        raise InputError(f"{name!r} is a {kind} already, in {taken[name]}; choose another name")
    sentence = name.replace("_", " ").capitalize()
    words = {
        "name": name, "cls": "".join(word.capitalize() for word in name.split("_")),
        "sentence": sentence, "folder": folder.name,
    }  # fmt: skip
    files = {f"{name}.py": f"{kind}.py.template", f"test_{name}.py": f"test_{kind}.py.template"}
    texts = {
        folder / file: Template((TEMPLATES / template).read_text("utf-8")).substitute(words)
        for file, template in files.items()
    }
    return write_new(texts)
