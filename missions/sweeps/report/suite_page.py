"""The HTML page about a suite of faults: one table, and what failed."""

from __future__ import annotations

from collections.abc import Mapping

from missions.execution.fit.faults import NONE
from missions.inspection.page import words
from missions.sweeps.suite import Cell, Suite, figures, over_missions, reasons

COLOURS = {"ok": "var(--good)", "collision": "var(--bad)", "": "transparent"}

OWN_STYLE = """
table.suite td { text-align: center; } table.suite th.fault { writing-mode: vertical-rl; }
table.suite td.mission { text-align: left; }
"""

Cells = Mapping[tuple[str, str], Cell]


def suite_page(suite: Suite, cells: Cells) -> str:
    """Return the page."""
    successes, runs, collisions = figures(suite, cells)
    lead = f"{successes} of {runs} runs with a fault succeeded, {collisions} had a collision"
    rows = "".join(_row(suite, cells, one.name, one.unfit) for one in suite.sweeps)
    heads = "".join(f"<th class='fault'>{words.safe(name)}</th>" for name in (NONE, *suite.faults))
    rates = "".join(_rate(over_missions(suite, cells, name)) for name in (NONE, *suite.faults))
    heads_failed = ("mission", "fault", "outcome", "reason")
    failures = words.table(heads_failed, (map(words.cell, row) for row in reasons(cells)))
    parts = [
        f'<h1>Missions with faults</h1><p class="lead">{lead}</p>',
        f'<table class="suite"><tr><th>mission</th>{heads}</tr>{rows}',
        f"<tr><td class='mission'>succeeded</td>{rates}</tr></table>",
        words.dim(
            "An empty cell: the fault does not fit the robot or the world, or the run was not made."
        ),
        words.section("What failed", failures),
    ]
    return words.document("faults", parts, OWN_STYLE)


def _row(suite: Suite, cells: Cells, mission: str, unfit: Mapping[str, str]) -> str:
    found = "".join(
        _cell(cells[mission, fault], unfit.get(fault, "")) for fault in (NONE, *suite.faults)
    )
    return f"<tr><td class='mission'>{words.safe(mission)}</td>{found}</tr>"


def _cell(cell: Cell, unfit: str) -> str:
    word = cell.word
    text = "" if not word else "✓" if word == "ok" else word
    reason = next((row.reason for row in cell.rows if row.reason), unfit)
    colour = COLOURS.get(word, "var(--busy)")
    return f"<td style='color: {colour}' title='{words.safe(reason)}'>{words.safe(text)}</td>"


def _rate(cell: Cell) -> str:
    return f"<td>{cell.successes}/{len(cell.rows)}</td>" if cell.rows else "<td></td>"
