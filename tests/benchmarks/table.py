"""Tables for the terminal."""

from __future__ import annotations

from typing import Any

Rows = list[dict[str, Any]]

FAILED = "failed"
"""The column whose text names every failed run, separated by `; `: too long for a table."""


def show(title: str, rows: Rows) -> None:
    """Print rows as a table, and below it what failed in each row, a line for each failure."""
    print(f"\n{title}")
    if not rows:
        print("  (nothing)")
        return
    columns = [column for column in rows[0] if column != FAILED]
    cells = [[_text(row.get(column)) for column in columns] for row in rows]
    widths = [
        max(len(column), *(len(line[n]) for line in cells)) for n, column in enumerate(columns)
    ]
    for line in [columns, ["-" * width for width in widths], *cells]:
        print(
            "  " + "  ".join(f"{cell:<{width}}" for cell, width in zip(line, widths, strict=True))
        )
    for row in rows:
        for failure in filter(None, str(row.get(FAILED, "")).split("; ")):
            print(f"  {_text(row[columns[0]])}: {failure}")


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 0.1 else f"{value:.2f}"
    return "" if value is None else str(value)
