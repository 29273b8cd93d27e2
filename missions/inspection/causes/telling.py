"""Causes as lines for the terminal, and as values for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from missions.inspection.causes.cause import Cause, Fact
from missions.inspection.page.story import Story
from stack.types.printable import printable

FORMAT = 1
"""Version of the JSON; counted up when a key changes its meaning."""


def plain_of(story: Story, causes: Sequence[Cause]) -> dict[str, Any]:
    """Return what `treepilot diagnose --json` prints."""
    failed = story.failed
    return {
        "format": FORMAT,
        "run": story.name,
        "status": story.status,
        "reason": story.reason,
        "seconds": story.end,
        "failed": None if failed is None else asdict(failed),
        "causes": [cause.plain() for cause in causes],
    }


def sure_cause(causes: Sequence[Cause]) -> Cause | None:
    """Return the first cause if the records show it directly."""
    return next((cause for cause in causes[:1] if cause.is_sure), None)


def headline(story: Story, causes: Sequence[Cause]) -> str:
    """Return when and where a mission ended, and why: the cause, or the reason without a sure one.

    As in: after 9.0 s: timeout 9 s: TIMED_OUT, because nothing came from lidar after 2.9 s.
    """
    when = f"after {story.over:.1f} s"
    if story.report is None:
        when += "; it ended without a report: it was killed, or is not over"
    failed, cause = story.failed, sure_cause(causes)
    if failed is None:
        return f"{when}: {story.reason}" if story.reason else when
    where = f"{when}: {failed.name}: {failed.code}"
    return f"{where} {failed.message}" if cause is None else f"{where}, because {cause.sentence}"


def lines_of(story: Story, causes: Sequence[Cause]) -> Iterator[str]:
    """Yield what `treepilot diagnose` prints."""
    yield printable(f"{story.name}: {story.status} {headline(story, causes)}")
    if story.status == "success":
        yield "The run went well: there is nothing to explain."
        return
    if story.failed is not None:
        yield printable(f"  {story.failed.where}  {story.failed.line}")
        if sure_cause(causes):
            yield printable(f"  {story.failed.message}")
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
    place = "" if fact.at is None else f", {fact.how} ({fact.at[0]:.2f}, {fact.at[1]:.2f})"
    return f"{time}{fact.text}{place}"
