"""Drawings of a compiled tree with its decorators: text, Graphviz and Mermaid."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap

from missions.language.kinds import outline_of
from missions.language.kinds.kind import Outline
from missions.trees.mission_tree import MissionTree
from stack.telemetry.records import TreeRow

LABEL_WIDTH = 40
"""Characters per line in boxes of Graphviz and Mermaid; longer text is wrapped."""

_MARKS = {"running": "▶", "success": "✓", "failure": "✗", "idle": "·"}
_COLOURS = {"running": "33", "success": "32", "failure": "31", "idle": "0"}
_DIM, _RESET = "\x1b[2m", "\x1b[0m"
_FILLS = {"running": "khaki", "success": "palegreen", "failure": "salmon", "idle": "white"}
_MERMAID = {Outline.HEXAGON: ("{{", "}}"), Outline.ELLIPSE: ("([", "])")}
"""Brackets of outlines; those of the others are square."""


def text(tree: MissionTree, *, colour: bool = False) -> str:
    """Draw the tree with one line per node; colours are ANSI escapes."""
    return "\n".join([tree.name, *_lines(tree.rows(), colour)])


def _lines(rows: tuple[TreeRow, ...], colour: bool) -> Iterable[str]:
    by_parent: dict[int, list[TreeRow]] = {}
    for row in rows:
        by_parent.setdefault(row.parent, []).append(row)

    def below(parent: int, indent: str) -> Iterable[str]:
        children = by_parent.get(parent, [])
        for row in children:
            last = row is children[-1]
            yield indent + ("└─ " if last else "├─ ") + _line(row, colour)
            yield from below(row.id, indent + ("   " if last else "│  "))

    return below(-1, "")


def _line(row: TreeRow, colour: bool) -> str:
    kind = "" if row.name.startswith(row.kind) else f" [{row.kind}]"
    message = f"  {row.message}" if row.message else ""
    if not colour:
        return f"{_MARKS[row.status]} {row.name}{kind}{message}"
    status = f"\x1b[{_COLOURS[row.status]}m"
    return f"{status}{_MARKS[row.status]} {row.name}{_RESET}{_DIM}{kind}{message}{_RESET}"


def dot(tree: MissionTree, *, colour: bool = False) -> str:
    """Return the tree in the DOT language; colours show the status."""
    lines = [
        f"digraph {_quoted(tree.name)} {{", "  ordering=out;",
        '  node [fontname="sans-serif", fontsize=10];',
    ]  # fmt: skip
    for row in tree.rows():
        shape = outline_of(row.kind)
        fill = f', style=filled, fillcolor="{_FILLS[row.status]}"' if colour else ""
        lines.append(f"  n{row.id} [label={_quoted(_label(row))}, shape={shape}{fill}];")
        if row.parent >= 0:
            lines.append(f"  n{row.parent} -> n{row.id};")
    return "\n".join([*lines, "}"])


def mermaid(tree: MissionTree, *, colour: bool = False) -> str:
    """Return the tree as a Mermaid flowchart; colours show the status."""
    lines = ["flowchart TD"]
    for row in tree.rows():
        opened, closed = _MERMAID.get(outline_of(row.kind), ("[", "]"))
        label = _label(row).replace('"', "#quot;").replace("\n", "<br/>")
        lines.append(f'  n{row.id}{opened}"{label}"{closed}')
        if row.parent >= 0:
            lines.append(f"  n{row.parent} --> n{row.id}")
        if colour:
            lines.append(f"  style n{row.id} fill:{_FILLS[row.status]}")
    return "\n".join(lines)


def _label(row: TreeRow) -> str:
    kind = not row.name.startswith(row.kind)
    lines = [*wrap(row.name, LABEL_WIDTH), *([row.kind] if kind else [])]
    return "\n".join([*lines, *wrap(row.message, LABEL_WIDTH)])


def _quoted(words: str) -> str:
    escaped = words.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
