"""Generates the tables of docs/reference.md from the tables of the reader and the compiler.

`python -m tests.missions.language.reference` writes them to the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from missions.language.codes import CODES
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES
from missions.language.expressions.value_types import NAMED
from missions.language.keys import CASE, EVENT, EXPECTATION, MODIFIERS, TREE_FILE, Form, Key, Keys
from missions.language.kinds import NODES
from missions.language.sections import PLACES, SECTIONS
from stack.parameters import units
from stack.types import FailureCode

PAGE = Path(__file__).parents[3] / "docs" / "reference.md"
_TABLE = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def fill(text: str) -> str:
    """Regenerate the text between `<!-- table: name -->` and `<!-- end -->` of a document."""
    tables = _tables()
    return _TABLE.sub(lambda found: f"{found[1]}{tables[found[2]]}\n{found[3]}", text)


def _tables() -> dict[str, str]:
    by_dimension: dict[str, list[str]] = {}
    for unit, (dimension, _) in units().items():
        by_dimension.setdefault(dimension or "plain number", []).append(f"`{unit}`")
    values = {name: (str(item.type), item.help) for name, item in ROBOT_VALUES.items()}
    values[f"{DISTANCE}($place)"] = ("number in m", "straight-line distance from the robot")
    return {
        "composites": _table(
            ("word", "meaning"), ((f"`{word}`", kind.doc) for word, kind in NODES.items())
        ),
        "modifiers": _keys("word", MODIFIERS),
        "keys": _table(("where", "key", "value", "meaning"), _key_rows()),
        "events": _keys("key", EVENT),
        "cases": _keys("key", CASE),
        "expectations": _keys("key", EXPECTATION),
        "values": _table(("name", "type", "meaning"), ((f"`{k}`", *v) for k, v in values.items())),
        "functions": _table(
            ("function", "type", "meaning"),
            ((f"`{item.signature}`", item.result, item.help) for item in FUNCTIONS.values()),
        ),
        "types": _table(("word", "type"), ((f"`{k}`", str(v)) for k, v in NAMED.items())),
        "units": _table(("SI unit", "accepted units"),
                        ((k, " ".join(v)) for k, v in by_dimension.items())),
        "failures": _table(
            ("code", "meaning", "what helps"),
            ((f"`{code}`", code.meaning, code.remedy) for code in FailureCode),
        ),
        "codes": _table(
            ("code", "about", "cause", "example", "fix"),
            ((f"`{code}`", item.title, item.cause, _example(item.example), item.fix)
             for code, item in CODES.items()),
        ),
    }  # fmt: skip


def value_words(key: Key) -> str:
    """Return how the value of a key is written."""
    words = ", ".join(f"`{word}`" for word in key.words)
    if key.form is Form.WORD:
        return words
    shown = "" if key.declared is None else key.declared.type_name()
    text = shown if key.form in (Form.VALUE, Form.LITERAL) else key.form.value
    if key.form is Form.SECTION and shown:
        text = f"{shown}, or keys"
    return f"{text}, {words}" if words and key.form is not Form.OUTCOMES else text


def _key_rows() -> Iterable[tuple[str, ...]]:
    """Return a row for each key of a section that has no table of its own."""
    for section, keys in SECTIONS.items():
        for word, key in keys.items() if keys not in (MODIFIERS, TREE_FILE) else ():
            needed = " (required)" if key.required else ""
            yield PLACES[section], f"`{word}`{needed}", value_words(key), key.doc


def _keys(head: str, keys: Keys) -> str:
    return _table((head, "meaning"), ((f"`{word}`", key.doc) for word, key in keys.items()))


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |"
                     for line in lines)  # fmt: skip


def _example(text: str) -> str:
    return " ".join(f"`{line}`" for line in text.splitlines())


if __name__ == "__main__":
    PAGE.write_text(fill(PAGE.read_text("utf-8")), "utf-8")
