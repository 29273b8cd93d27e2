"""The likely causes of a failure, the strongest first."""

from __future__ import annotations

from missions.inspection.causes import (
    costmaps,
    endings,
    holdups,
    motion,
    passages,
    planning,
    poses,
    sensors,
    time_limits,
)
from missions.inspection.causes.cause import LEAST, Cause, in_order
from missions.inspection.causes.evidence import Evidence
from missions.inspection.page.story import Story

MOST_EARLIER = 3
"""Earlier failures that are looked at: a fallback may have hidden the cause."""

EVERY = (
    *endings.CAUSES, *time_limits.CAUSES, *motion.CAUSES, *poses.CAUSES, *costmaps.CAUSES,
    *passages.CAUSES, *sensors.CAUSES, *planning.CAUSES, *holdups.CAUSES,
)  # fmt: skip
"""Functions of the evidence; of two equally strong causes, that of the earlier one comes first."""


def causes_of(story: Story) -> list[Cause]:
    """Return the likely causes of what went wrong in a run; none if it succeeded.

    If the records explain nothing of the decisive failure, such as a check at the end of a
    fallback, they are those of the newest earlier failure that they explain.
    """
    if story.status == "success":
        return []
    found = _judged(Evidence(story, story.failed))
    earlier = [] if found or story.failed is None else story.failures.every[::-1][:MOST_EARLIER]
    return next(filter(None, (_judged(Evidence(story, node)) for node in earlier)), found)


def _judged(evidence: Evidence) -> list[Cause]:
    found = [in_order(cause) for judge in EVERY if (cause := judge(evidence)) is not None]
    return sorted((one for one in found if one.strength >= LEAST), key=lambda one: -one.strength)
