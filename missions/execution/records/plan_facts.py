"""What was known of a run before it began, for explanations of it.

Explanations of a run read these facts instead of preparing its mission: a run of somebody else
brings plugins, and to prepare a mission is to import them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missions.execution.build.world import landmarks_of
from missions.execution.prepare import PreparedMission
from missions.execution.records.origins import origins_of
from stack.documents.files import JSON_BYTES, read_bytes
from stack.navigation.landmarks import Doorway
from stack.telemetry.codec import MalformedError, field_codecs

LIST, FACTS = "inputs.json", "facts"
"""File of the run folder, and the key of the facts in it."""


@dataclass(frozen=True, slots=True)
class NotedWarning:
    """A warning of `check`: `file` is a name without its folder, `line` counts from 1."""

    file: str
    line: int
    code: str
    sentence: str
    hint: str


@dataclass(frozen=True, slots=True)
class NotedSetting:
    """A parameter that was not the default: value and default with their unit.

    `source` is the file that sets it, without its folders, and the line if known, or the option.
    """

    value: str
    default: str
    source: str


@dataclass(frozen=True, slots=True)
class PlanFacts:
    """Facts of a prepared mission.

    A field that the version that recorded the run did not write has its default.

    Attributes:
        settings: parameters that were not the defaults, by full name; None: not recorded.
        layers: names of the costmap's layers, in order.
        linear_speed: the robot's limit, m/s; 0: not recorded.
        doors: of a map that was made of the world.
        people: their names, in the order of the world.
        warnings: of `check`.
    """

    settings: Mapping[str, NotedSetting] | None = None
    layers: tuple[str, ...] = ()
    linear_speed: float = 0.0
    doors: tuple[Doorway, ...] = ()
    people: tuple[str, ...] = ()
    warnings: tuple[NotedWarning, ...] = ()

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        codecs = field_codecs(PlanFacts)
        return {name: codec.encode(getattr(self, name)) for name, codec in codecs.items()}


def facts_of(plan: PreparedMission, given: Mapping[str, str]) -> PlanFacts:
    """Return the facts of a prepared mission.

    Args:
        plan: the mission.
        given: parameters of the command line, by full name.
    """
    return PlanFacts(
        settings={
            one.name: NotedSetting(one.value, one.default, one.source)
            for one in origins_of(plan, given)
            if one.value != one.default
        },
        layers=tuple(part.name for part in plan.choices["costmap"].parts),
        linear_speed=plan.robot.limits.linear_speed,
        doors=tuple(landmarks_of(plan).doors),
        people=tuple(person.name for person in plan.world.people),
        warnings=tuple(
            NotedWarning(
                Path(one.mark.file).name, one.mark.line, one.code, one.sentence, str(one.hint)
            )
            for one in plan.warnings
        ),
    )


def read_facts(folder: Path) -> PlanFacts:
    """Return the facts of a run folder; a fact that it does not tell has its default."""
    try:
        noted = json.loads(read_bytes(folder / LIST, JSON_BYTES))[FACTS]
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return PlanFacts()
    known = {}
    for name, codec in field_codecs(PlanFacts).items():
        with suppress(LookupError, TypeError, MalformedError):
            known[name] = codec.decode(noted[name])
    return PlanFacts(**known)
