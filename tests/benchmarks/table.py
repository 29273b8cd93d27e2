"""Tables for the terminal."""

from __future__ import annotations

from typing import Any

Rows = list[dict[str, Any]]


def show(title: str, rows: Rows) -> None:
    """Print rows as a table."""
    print(f"\n{title}")
    if not rows:
        print("  (nothing)")
        return
    columns = list(rows[0])
    cells = [[_text(row.get(column)) for column in columns] for row in rows]
    widths = [
        max(len(column), *(len(line[n]) for line in cells)) for n, column in enumerate(columns)
    ]
    for line in [columns, ["-" * width for width in widths], *cells]:
        print(
            "  " + "  ".join(f"{cell:<{width}}" for cell, width in zip(line, widths, strict=True))
        )


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 0.1 else f"{value:.2f}"
    return "" if value is None else str(value)
