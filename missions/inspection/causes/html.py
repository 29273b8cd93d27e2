"""The first causes of a failure, for the report page."""

from __future__ import annotations

from collections.abc import Collection
from html import escape

from missions.inspection.causes.cause import Cause
from missions.inspection.causes.ranking import causes_of
from missions.inspection.causes.telling import fact_line
from missions.inspection.page.story import Story
from stack.types.printable import printable

MOST = 3
"""Causes on the page; `treepilot diagnose` tells all."""


def causes_html(story: Story) -> str:
    """Return the first causes of what went wrong; empty if nothing did or none is known.

    A fact that is the message of a failed node is left out: the page has it with its line.
    """
    told = {failing.message for failing in story.failures}
    return "".join(_cause(cause, told) for cause in causes_of(story)[:MOST])


def _cause(cause: Cause, told: Collection[str]) -> str:
    facts = "".join(
        f"<li>{_safe(fact_line(fact))}</li>" for fact in cause.facts if fact.text not in told
    )
    return (
        f'<div class="note"><b>{_safe(cause.name)}</b> <span class="dim">{cause.strength:.0%}'
        f"</span>: {_safe(cause.sentence)}<ul>{facts}</ul>What to do: {_safe(cause.advice)}</div>"
    )


def _safe(words: str) -> str:
    return escape(printable(words))
