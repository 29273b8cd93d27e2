"""Causes as lines for the terminal, and as values for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from missions.inspection.causes.cause import Cause, Fact
from missions.inspection.causes.failed_nodes import failed_node
from missions.inspection.page.story import Story
from stack.types.printable import printable

FORMAT = 1
"""Version of the JSON; counted up when a key changes its meaning."""


def plain_of(story: Story, causes: Sequence[Cause]) -> dict[str, Any]:
    """Return what `treepilot diagnose --json` prints."""
    failed = failed_node(story)
    return {
        "format": FORMAT,
        "run": story.name,
        "status": story.status,
        "reason": story.reason,
        "seconds": story.end,
        "failed": None if failed is None else asdict(failed),
        "causes": [cause.plain() for cause in causes],
    }


def lines_of(story: Story, causes: Sequence[Cause]) -> Iterator[str]:
    """Yield what `treepilot diagnose` prints."""
    yield printable(f"{story.name}: {story.status} after {story.end:.1f} s")
    if story.status == "success":
        yield "The run went well: there is nothing to explain."
        return
    failed = failed_node(story)
    if failed is not None:
        yield printable(f"  {failed.time:.1f} s  {failed.name}: {failed.code} {failed.message}")
        yield printable(f"  {failed.where}  {failed.line}")
    elif story.reason:
        yield printable(f"  {story.reason}")
    if not causes:
        yield "The records show no known cause. `treepilot replay` shows what the robot saw."
    for number, cause in enumerate(causes, start=1):
        yield ""
        yield printable(f"{number}. {cause.name} ({cause.strength:.0%}): {cause.sentence}")
        for fact in cause.facts:
            yield printable(f"   {fact_line(fact)}")
        yield printable(f"   > {cause.advice}")


def fact_line(fact: Fact) -> str:
    """Return a fact with its time and place."""
    time = "" if fact.time is None else f"{fact.time:.1f} s: "
    place = "" if fact.at is None else f", at ({fact.at[0]:.2f}, {fact.at[1]:.2f})"
    return f"{time}{fact.text}{place}"
