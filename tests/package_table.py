"""The table of packages in docs/architecture.md: the first line of each package's docstring.

`python -m tests.package_table` writes it.
"""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/architecture.md"
TOP = ("treepilot", "missions", "behaviours", "stack", "robots", "tui")
HEADING, NEXT = "## Where to look\n", "## Choices\n"
INTRODUCTION = """
The first line of each package's docstring says what is there; `python -m tests.package_table`
writes them into this table.

| Package | What is there |
|---|---|
"""


def packages() -> dict[str, str]:
    """Return the first line of the docstring of each package, by its path."""
    files = [file for top in TOP for file in sorted((ROOT / top).rglob("__init__.py"))]
    return {
        file.parent.relative_to(ROOT).as_posix(): first_line(file.read_text("utf-8"))
        for file in files
    }


def first_line(source: str) -> str:
    """Return the first line of a module's docstring; empty without one."""
    return (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0]


def written(page: str) -> str:
    """Return the page with the table of the packages as they are."""
    before, _, rest = page.partition(HEADING)
    rows = "".join(f"| {path} | {line} |\n" for path, line in packages().items())
    return f"{before}{HEADING}{INTRODUCTION}{rows}\n{NEXT}{rest.partition(NEXT)[2]}"


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text("utf-8")), "utf-8")
