"""Pages, tables and texts as HTML: of reports of runs, sweeps and tunings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape

from missions.inspection.page.style import STYLE
from stack.types.printable import printable


def document(title: str, parts: Iterable[str], style: str = "") -> str:
    """Return a page of these parts; `style` is added to the style sheet of all pages."""
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{safe(title)}</title><style>{STYLE}{style}</style></head><body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )


def section(title: str, content: str) -> str:
    """Return a part with its heading; nothing without content."""
    return f"<h2>{title}</h2>{content}" if content else ""


def table(heads: Sequence[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table of rows of cells, made by `cell` and `numeric`."""
    head = "".join(f"<th>{safe(one)}</th>" for one in heads)
    lines = "".join(f"<tr>{''.join(cells)}</tr>" for cells in rows)
    return f'<table><tr class="head">{head}</tr>{lines}</table>'


def scroll(content: str) -> str:
    """Return a table that is wider than small screens."""
    return f'<div class="scroll">{content}</div>'


def cell(words: object) -> str:
    """Return a text as a cell of a table."""
    return f"<td>{safe(words)}</td>"


def numeric(words: object) -> str:
    """Return a number as a cell of a table."""
    return f'<td class="number">{safe(words)}</td>'


def dim(words: str) -> str:
    """Return a remark below a table."""
    return f'<p class="dim">{words}</p>'


def safe(words: object) -> str:
    """Return a text as HTML."""
    return escape(printable(str(words)))


def prose(words: str) -> str:
    """Return sentences as HTML; what is between backticks is code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", safe(words))
