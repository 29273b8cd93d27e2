"""Tables of declarations for `treepilot describe`."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from stack.columns import columns
from stack.parameters import Declaration


def table(title: str, declared: Iterable[Declaration]) -> str:
    """Return a table of declarations: name, type, default, range and help."""
    rows = [
        (
            item.name,
            item.type_name(),
            "required" if item.required else f"default {shown(item)}",
            item.range_text(),
            item.help,
        )
        for item in declared
    ]
    return aligned(title, rows)


def parameter_table(declared: Collection[Declaration], *, expert: bool) -> str:
    """Return a table of the public parameters, with `expert` of all; says how many are hidden."""
    listed = [item for item in declared if item.public or expert]
    hidden = len(declared) - len(listed)
    hint = f"parameters for experts: {hidden}, shown by --expert" if hidden else ""
    return "\n".join(filter(None, [table("parameters", listed), hint]))


def aligned(title: str, rows: Sequence[Sequence[str]]) -> str:
    """Return a title and rows in columns; empty without rows."""
    if not rows:
        return ""
    return "\n".join([f"{title}:", *(f"  {line}" for line in columns(rows))])


def shown(item: Declaration) -> str:
    """Return the default of a declaration as text, with its unit."""
    if isinstance(item.default, float):
        return f"{item.default:g}{' ' + item.unit if item.unit else ''}"
    plain = item.default is None or isinstance(item.default, bool)
    return str(item.default).lower() if plain else str(item.default)
