"""What was known of a run before it began, for explanations of it.

Explanations of a run read these facts instead of preparing its mission: a run of somebody else
brings plugins, and to prepare a mission is to import them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import MISSING, Field, dataclass, fields
from pathlib import Path
from typing import Any

from missions.execution.build.world import landmarks_of
from missions.execution.prepare import PreparedMission
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
class PlanFacts:
    """Facts of a prepared mission.

    A field that the version that recorded the run did not write has its default.

    Attributes:
        settings: parameters that were not the defaults of their components, by full name; None:
            not recorded.
        layers: names of the costmap's layers, in order.
        linear_speed: the robot's limit, m/s; 0: not recorded.
        doors: of a map that was made of the world.
        warnings: of `check`.
    """

    settings: Mapping[str, str] | None = None
    layers: tuple[str, ...] = ()
    linear_speed: float = 0.0
    doors: tuple[Doorway, ...] = ()
    warnings: tuple[NotedWarning, ...] = ()

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        codecs = field_codecs(PlanFacts)
        return {name: codec.encode(getattr(self, name)) for name, codec in codecs.items()}


def facts_of(plan: PreparedMission) -> PlanFacts:
    """Return the facts of a prepared mission."""
    return PlanFacts(
        settings={
            f"{kind}.{item.name}": str(getattr(choice.parameters, item.name))
            for kind, choice in plan.choices.items()
            for item in fields(choice.parameters)
            if getattr(choice.parameters, item.name) != _default_of(item)
        },
        layers=tuple(part.name for part in plan.choices["costmap"].parts),
        linear_speed=plan.robot.limits.linear_speed,
        doors=tuple(landmarks_of(plan).doors),
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


def _default_of(item: Field[Any]) -> object:
    return item.default_factory() if item.default_factory is not MISSING else item.default
