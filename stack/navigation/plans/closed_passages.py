"""Says why a plan failed: by the names of places, and of what closes a way that the map has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import hypot

from stack.costmap.closed_way import closed_way
from stack.costmap.closing_zones import zone_words
from stack.navigation.drive_tools import DriveTools
from stack.navigation.plans.zone_names import zones_closing
from stack.types import Failure, FailureCode, Pose2D


def explained(
    failure: Failure, tools: DriveTools, pose: Pose2D, goals: Sequence[Pose2D]
) -> Failure:
    """Return the failure of a plan by the names of places; an event tells what closes the way.

    Args:
        failure: of the plan.
        tools: of the drive.
        pose: the start of the plan, map frame.
        goals: in turn, map frame.
    """
    marks = tools.landmarks
    failure = replace(failure, sentence=marks.named(failure.sentence, (pose, *goals)))
    zones = zones_closing(failure, tools.global_costmap, pose, goals)
    if zones:
        verb = "closes" if len(zones) == 1 else "close"
        text = f"{zone_words(zones)} {verb} the way"
        tools.emit("closed", text, "warning", place=[], door="", layer="", zones=list(zones))
        return replace(failure, sentence=f"{failure.sentence}; {text}")
    if failure.code != FailureCode.NO_VALID_PATH or failure.place is None:
        return failure
    (x, y), goal = failure.place, goals[-1]
    away = hypot(goal.x - x, goal.y - y)
    why = _closure(tools, pose, goals)
    sentence = (
        f"no path from {marks.name(pose)} to {marks.name(goal)}: {why}the nearest reachable place "
        f"is {marks.name(Pose2D(x, y))}, {away:.2f} m from the goal"
    )
    return replace(failure, sentence=sentence)


def _closure(tools: DriveTools, pose: Pose2D, goals: Sequence[Pose2D]) -> str:
    """Return what closes the first leg that the map has a way for; empty if nothing does."""
    costmap, marks = tools.global_costmap, tools.landmarks
    radius = tools.robot.footprint.inscribed_radius
    for start, goal in pairwise((pose, *goals)):
        found = closed_way(costmap.view, costmap.ground.cells, start, goal, radius)
        if found is None:
            continue
        door, origin = marks.door_at(found.at), costmap.explain(*found.at)
        text = marks.closed(found.at)
        tools.emit(
            "closed", text, "warning", place=list(found.at),
            door="" if door is None else door.name, layer="" if origin is None else origin.layer,
            zones=[],
        )  # fmt: skip
        return f"{text}; "
    return ""
