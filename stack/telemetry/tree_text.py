"""The behaviour tree as text."""

from __future__ import annotations

from stack.telemetry.records import RunInfo, Snapshot, TreeRow

STATUS_GLYPH = {"success": "✔", "failure": "✘", "running": "▶", "idle": "·"}
RERUN_GLYPH = STATUS_GLYPH | {"failure": "✗"}
"""The font of rerun's viewer lacks the other one, and the viewer without a window then crashes."""

MAX_ROWS = 60
NOTHING = "-"
_SPECIAL = str.maketrans({character: "\\" + character for character in "\\`*_[]<>#|$"})


def depths(rows: tuple[TreeRow, ...]) -> dict[int, int]:
    """Depth of each node by id; the root has depth 0."""
    found = {-1: -1}
    for row in rows:
        found[row.id] = found.get(row.parent, -1) + 1
    del found[-1]
    return found


def activity(rows: tuple[TreeRow, ...]) -> str:
    """Name of the first running leaf, or NOTHING without one."""
    parents = {row.parent for row in rows}
    return next(
        (row.name for row in rows if row.status == "running" and row.id not in parents), NOTHING
    )


def tree_markdown(snapshot: Snapshot, info: RunInfo) -> str:
    """The mission's state and its tree as nested lists in Markdown."""
    lines = [f"### {_plain(info.title or info.mission)}", ""]
    reason = f": {_plain(snapshot.reason)}" if snapshot.reason else ""
    lines += [f"**{snapshot.state}**{reason} at {snapshot.time:.1f} s", ""]
    depth_of = depths(snapshot.tree)
    for row in snapshot.tree[:MAX_ROWS]:
        name = _plain(row.name)
        shown = {"running": f"**{name}**", "failure": f"**{name}**"}.get(row.status, name)
        message = f" *{_plain(row.message)}*" if row.message else ""
        indent = "  " * depth_of[row.id]
        lines.append(f"{indent}- {RERUN_GLYPH.get(row.status, '?')} {shown}{message}")
    if len(snapshot.tree) > MAX_ROWS:
        lines.append(f"- and {len(snapshot.tree) - MAX_ROWS} more")
    return "\n".join(lines)


def _plain(text: str) -> str:
    """Escape a text for Markdown and join its lines."""
    return " ".join(text.split()).translate(_SPECIAL)


def deepest_running(tree: tuple[TreeRow, ...]) -> TreeRow | None:
    """Return the running node with the most ancestors, the first if there are several."""
    depth_of = depths(tree)
    running = (row for row in tree if row.status == "running")
    return max(running, key=lambda row: depth_of[row.id], default=None)
