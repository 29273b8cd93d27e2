"""docs/runs.md lists every kind of event that the code emits, and no other."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("missions", "behaviours", "stack", "robots")
LEVELS = {"info", "warning", "error"}
WORD = re.compile(r"[a-z_]+")


def _words(call):
    """Constants that may be the kind: by keyword, or one of the first two arguments."""
    by_name = {item.arg: item.value for item in call.keywords}
    places = [by_name["kind"]] if "kind" in by_name else call.args[:2]
    for place in places:
        # `"a" if … else "b"` names both
        for node in (place.body, place.orelse) if isinstance(place, ast.IfExp) else (place,):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value


VARIABLE = {"command", "teleop"}
"""Kinds of what an operator did, which are emitted under a variable."""

BY_PACKAGE = {"sim": {"report"}, "navigation": {"start"}}
"""Other functions that emit an event of the kind that they are given."""


def emitted():
    found = set(VARIABLE)
    for package in PACKAGES:
        for file in (ROOT / package).rglob("*.py"):
            names = {"emit", "_emit"} | BY_PACKAGE.get(file.relative_to(ROOT).parts[1], set())
            for call in ast.walk(ast.parse(file.read_text("utf-8"))):
                if isinstance(call, ast.Call):
                    function = call.func
                    name = getattr(function, "attr", getattr(function, "id", ""))
                    if name in names:
                        found |= {word for word in _words(call) if WORD.fullmatch(word)}
    return found - LEVELS


def documented():
    text = (ROOT / "docs/runs.md").read_text("utf-8")
    section = text[text.index("## events.jsonl") : text.index("## snapshots.mcap")]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    return {word for row in rows for word in re.findall(r"`([a-z_]+)`", row)}


def test_the_documented_kinds_are_those_that_are_emitted():
    assert emitted() - documented() == set(), "not documented"
    assert documented() - emitted() == set(), "documented, but not emitted"
