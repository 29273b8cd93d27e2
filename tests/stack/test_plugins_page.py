"""docs/plugins.md: its table has every kind, base class and method; its list every entry point."""

from __future__ import annotations

import re
from pathlib import Path

import treepilot
from stack.components import BASES, GROUPS, noun

PAGE = (Path(__file__).parents[2] / "docs" / "plugins.md").read_text("utf-8")
ROWS = {
    row[0]: row[1:]
    for row in re.findall(r"^\| ([a-z ]+) \| `(\w+)` \| (.*?) \| (.*?) \| .*? \|$", PAGE, re.M)
}
CLASSES = {noun(kind): base for kind, base in BASES.items()} | {"layer": treepilot.CostmapLayer}


def methods_in(cell: str) -> set[str]:
    """Names at the beginning of each piece of code in a cell."""
    return set(re.findall(r"`(\w+)", cell))


def test_the_table_lists_every_kind_by_its_public_name():
    assert {kind: getattr(treepilot, row[0]) for kind, row in ROWS.items()} == CLASSES


def test_must_have_are_the_abstract_methods_and_may_have_exist():
    for kind, (_, required, optional) in ROWS.items():
        assert methods_in(required) == CLASSES[kind].__abstractmethods__, kind
        for name in methods_in(required) | methods_in(optional):
            assert hasattr(CLASSES[kind], name), f"{kind}: {name}"


def test_every_entry_point_group_is_listed():
    listed = set(re.findall(r"`(treepilot\.\w+)`", PAGE.partition("entry-point groups")[2]))
    assert listed == set(GROUPS.values())
