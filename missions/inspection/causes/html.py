"""The first causes of a failure, for the report page."""

from __future__ import annotations

from collections.abc import Sequence

from missions.inspection.causes.cause import Cause
from missions.inspection.causes.telling import fact_line
from missions.inspection.page.words import prose

MOST = 3
"""Causes on the page; `treepilot diagnose` tells all."""


def causes_html(causes: Sequence[Cause]) -> str:
    """Return the first causes of what went wrong; empty if nothing did or none is known."""
    return "".join(map(_cause, causes[:MOST]))


def _cause(cause: Cause) -> str:
    facts = "".join(f"<li>{prose(fact_line(fact))}</li>" for fact in cause.facts)
    return (
        f'<div class="note"><b>{prose(cause.name)}</b> <span class="dim">explains '
        f"{cause.strength:.0%} of the failure</span>: {prose(cause.sentence)}<ul>{facts}</ul>"
        f"What to do: {prose(cause.advice)}</div>"
    )
