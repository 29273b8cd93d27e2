"""Tables for the terminal."""

from __future__ import annotations

from missions.bench.bench import CAUSES, Rows, table_lines

__all__ = ["Rows", "show"]


def show(title: str, rows: Rows) -> None:
    """Print rows as a table, and below it what failed in each row, a line for each failure."""
    print(f"\n{title}")
    for line in table_lines(rows) or ["(nothing)"]:
        print(f"  {line}")
    for row in rows:
        for failure in filter(None, str(row.get(CAUSES, "")).split("; ")):
            print(f"  {next(iter(row.values()))}: {failure}")
