"""The likely causes of a failure, the strongest first."""

from __future__ import annotations

from missions.inspection.causes import (
    costmaps,
    endings,
    holdups,
    passages,
    planning,
    poses,
    sensors,
    time_limits,
)
from missions.inspection.causes.cause import LEAST, Cause
from missions.inspection.causes.evidence import Evidence
from missions.inspection.page.story import Story

EVERY = (
    *endings.CAUSES, *time_limits.CAUSES, *poses.CAUSES, *costmaps.CAUSES, *passages.CAUSES,
    *sensors.CAUSES, *planning.CAUSES, *holdups.CAUSES,
)  # fmt: skip
"""Functions of the evidence; of two equally strong causes, that of the earlier one comes first."""


def causes_of(story: Story) -> list[Cause]:
    """Return the likely causes of what went wrong in a run; none if it succeeded."""
    if story.status == "success":
        return []
    evidence = Evidence(story)
    found = [cause for judge in EVERY if (cause := judge(evidence)) is not None]
    return sorted((one for one in found if one.strength >= LEAST), key=lambda one: -one.strength)
