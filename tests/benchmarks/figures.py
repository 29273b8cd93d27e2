"""Measured figures in docs/figures, and the tables of the documentation that show them.

`python -m tests.benchmarks.figures` writes every table anew; `--check` only compares. A table
stands between two comments, `<!-- figures: NAME -->` and `<!-- /figures -->`.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from datetime import date
from functools import cache
from pathlib import Path
from string import Formatter
from typing import Any

from jsonschema import Draft202012Validator

from tests.benchmarks.benchmark import benches
from tests.benchmarks.layouts import LAYOUTS, NONE, SUMMARY, Layout
from tests.benchmarks.origin import ROOT
from tests.benchmarks.table import Rows

FIGURES = ROOT / "docs" / "figures"
BLOCK = re.compile(r"(<!-- figures: ([\w-]+) -->\n)(.*?)(<!-- /figures -->)", re.DOTALL)
MARKER = re.compile(r"<!-- /?figures")
TEXT = {"type": "string", "pattern": r"^[^/\\]+$"}
NUMBER_OR_TEXT = {"anyOf": [{"type": "number"}, TEXT]}
SCHEMA = {
    "type": "object",
    "properties": {
        "name": {"type": "string", "pattern": "^[a-z_]+$"},
        "command": {"type": "string", "pattern": r"^python -m tests\.benchmarks [^/\\]+$"},
        "commit": {"type": "string", "pattern": "^[0-9a-f]{40}$"},
        "dirty": {"type": "boolean"},
        "date": {"type": "string", "pattern": r"^\d{4}-\d{2}-\d{2}$"},
        "machine": {
            "type": "object",
            "properties": {
                "processor": {"type": "string", "minLength": 1},
                "cores": {"type": "integer", "minimum": 1},
                "load": {"type": "number", "minimum": 0},
                "system": {"type": "string", "minLength": 1},
                "python": {"type": "string", "pattern": r"^\d+\.\d+\.\d+"},
                "numpy": {"type": "string", "pattern": r"^\d+\.\d+"},
                "pybullet": {"type": "string", "pattern": r"^\d+\.\d+"},
            },
        },
        "setting": {
            "type": "object",
            "properties": {"recording": {"enum": ["off", "on", "off and on"]}},
            "additionalProperties": NUMBER_OR_TEXT,
            "minProperties": 1,
        },
        "rows": {"type": "array", "minItems": 1, "items": {"type": "object", "minProperties": 2}},
    },
    "additionalProperties": False,
}
for _part in (SCHEMA, SCHEMA["properties"]["machine"]):  # type: ignore[index]
    _part["required"] = [*_part["properties"]]
SCHEMA["properties"]["machine"]["additionalProperties"] = False  # type: ignore[index]


class FiguresError(Exception):
    """A figures file or a table of the documentation is wrong."""


@dataclass(frozen=True)
class Figures:
    """One file of docs/figures.

    Attributes:
        name: of the benchmark, the file and the table.
        command: measures the figures again.
        commit: of the code that was measured. dirty: whether it differed from that commit.
        date: when it was measured, UTC.
        machine: as `origin.machine` gives it.
        setting: what was chosen: recording, trials, controllers…
        rows: the figures.
    """

    name: str
    command: str
    commit: str
    dirty: bool
    date: str
    machine: dict[str, Any]
    setting: dict[str, str | int | float]
    rows: Rows

    @property
    def caption(self) -> str:
        """A sentence on where the figures come from; the file has the versions too."""
        dirty = " with uncommitted changes" if self.dirty else ""
        day = date.fromisoformat(self.date)
        setting = ", ".join(f"{key} {value}" for key, value in self.setting.items())
        found = self.machine
        return (
            f"*Commit `{self.commit[:10]}`{dirty}, {day.day} {day:%B %Y}; {setting}; "
            f"{found['processor']}, {found['cores']} cores, load {found['load']:.1f}. "
            f"Command: `{self.command}`.*"
        )


def write(figures: Figures, folder: Path = FIGURES) -> None:
    """Write a file, whole, with floats to four decimals.

    Raises:
        FiguresError: the figures are incomplete.
    """
    plain = _rounded(asdict(figures))
    _validate(plain, figures.name)
    folder.mkdir(parents=True, exist_ok=True)
    temporary = folder / f".{figures.name}.json"
    temporary.write_text(json.dumps(plain, indent=1, ensure_ascii=False) + "\n", "utf-8")
    temporary.replace(folder / f"{figures.name}.json")


def read(name: str, folder: Path = FIGURES) -> Figures:
    """A file, checked.

    Raises:
        FiguresError: it is incomplete.
    """
    plain = json.loads((folder / f"{name}.json").read_text("utf-8"))
    _validate(plain, name)
    return Figures(**plain)


@cache
def layouts() -> dict[str, Layout]:
    """The layout of every table, by name."""
    own = {name: bench.layout for name, bench in benches().items() if bench.layout is not None}
    return {**LAYOUTS, **own}


def block(name: str, folder: Path = FIGURES) -> str:
    """The text between the two comments of a table.

    Raises:
        FiguresError: no table of that name, or its figures are incomplete.
    """
    if name == "summary":
        return summary(folder)
    if name not in layouts():
        raise FiguresError(f"no table {name!r}; expected summary, {', '.join(layouts())}")
    if not (folder / f"{name}.json").exists():
        return f"\n*Not measured yet. Command: `python -m tests.benchmarks {name} --docs`.*\n\n"
    figures, layout = read(name, folder), layouts()[name]
    failures = [
        f"* {_filled(layout.failed, row, name)}: {row['failed']}"
        for row in figures.rows
        if layout.failed and row["failed"]
    ]
    listed = ["", "Failures:", "", *failures] if failures else []
    return "\n".join(["", *_table(layout, figures), *listed, "", figures.caption, "", ""])


def summary(folder: Path = FIGURES) -> str:
    """The README's table: a line from each of the most important files that are there."""
    rows = [
        f"| {what} | {figure} |"
        for name, line in SUMMARY.items()
        if (folder / f"{name}.json").exists()
        for what, figure in [line(read(name, folder).rows)]
    ]
    if not rows:
        return "\n*Not measured yet.*\n\n"
    return "\n".join(["", "| benchmark | result |", "|---|---|", *rows, "", ""])


def updated(text: str, folder: Path = FIGURES) -> str:
    """A document with its tables written anew.

    Raises:
        FiguresError: a comment has no counterpart, or a table cannot be written.
    """
    markers, blocks = len(MARKER.findall(text)), len(BLOCK.findall(text))
    if markers != 2 * blocks:
        raise FiguresError(f"{markers} comments of figures make {blocks} tables; expected pairs")
    return BLOCK.sub(lambda found: found[1] + block(found[2], folder) + found[4], text)


def documents() -> list[Path]:
    """Every page that may show figures."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def update_documents(*, check: bool = False) -> list[str]:
    """Write the tables of all documents; the names of those that differed.

    Args:
        check: write nothing.

    Raises:
        FiguresError: a table cannot be written.
    """
    texts = {file: file.read_text("utf-8") for file in documents()}
    new = {file: updated(text) for file, text in texts.items()}
    outdated = [file for file, text in texts.items() if new[file] != text]
    for file in outdated:
        if not check:
            file.write_text(new[file], "utf-8")
    return [file.name for file in outdated]


def main() -> None:
    """Write the tables of all documents, or compare them."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--check", action="store_true", help="write nothing; exit 1 if outdated")
    given = arguments.parse_args()
    try:
        outdated = update_documents(check=given.check)
    except FiguresError as error:
        sys.exit(str(error))
    if outdated:
        print(f"{'outdated' if given.check else 'updated'}: {', '.join(outdated)}")
    sys.exit(bool(given.check and outdated))


def _table(layout: Layout, figures: Figures) -> Iterator[str]:
    added = {
        heading: template
        for heading, template in layout.added.items()
        if all(name in row for row in figures.rows for name in _fields(template))
    }
    columns = {**layout.columns, **added}
    yield "| " + " | ".join(columns) + " |"
    yield "|" + "---|" * len(columns)
    for row in figures.rows:
        cells = (_filled(template, row, figures.name) for template in columns.values())
        yield "| " + " | ".join(cells) + " |"


def _fields(template: str) -> list[str]:
    return [field for _, field, _, _ in Formatter().parse(template) if field is not None]


def _filled(template: str, row: dict[str, Any], name: str) -> str:
    """A format string over a row; a dash where one of its values is missing on purpose.

    Raises:
        FiguresError: the row has no such key.
    """
    wanted = _fields(template)
    for field in wanted:
        if field not in row:
            raise FiguresError(f"{name}.json: a row has no {field!r}; it has {', '.join(row)}")
    if any(row[field] is None for field in wanted):
        return NONE
    return template.format(**row)


def _validate(plain: dict[str, Any], name: str) -> None:
    for error in sorted(Draft202012Validator(SCHEMA).iter_errors(plain), key=str):
        raise FiguresError(f"{name}.json: {error.json_path}: {error.message}")
    if plain["name"] != name:
        raise FiguresError(f"{name}.json: its name is {plain['name']!r}; expected {name!r}")


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 4)
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list) else value


if __name__ == "__main__":
    main()
