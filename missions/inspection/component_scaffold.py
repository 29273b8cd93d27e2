"""`treepilot new`: write a new component with its test.

The templates are in the folder `templates`. For behaviours see `behaviours.scaffold`.
"""

from __future__ import annotations

from pathlib import Path
from string import Template

from behaviours.scaffold import check_name, write_new
from missions.language.sections import mission_words
from stack.components import GROUPS, available, with_article
from stack.errors import InputError

TEMPLATES = Path(__file__).parent / "templates"
KINDS = {
    "planner": "planner", "controller": "controller", "estimator": "localisation",
    "layer": "costmap_layer",
}  # fmt: skip
"""Word of `treepilot new` -> kind of component."""


def new_component(kind: str, name: str, folder: Path) -> list[Path]:
    """Write `<name>.py` and `test_<name>.py` into a plugin folder; create the folder if missing.

    Args:
        kind: planner, controller, estimator or layer.
        name: name in missions, e.g. straight_line.
        folder: the plugin folder; missions name it under `plugins`.

    Returns:
        The files written.

    Raises:
        InputError: the name is invalid or in use, or a file of that name exists.
    """
    check_name(name, with_article(KINDS[kind]), mission_words())
    known = available(KINDS[kind]) if KINDS[kind] in GROUPS else {}
    if name in known:
        taken = f"{name!r} is already {with_article(KINDS[kind])}, in {known[name]}"
        raise InputError(f"{taken}; choose another name")
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
