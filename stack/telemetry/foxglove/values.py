"""The JSON messages: state, figures, tree and events of a run, with their schemas."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, is_dataclass
from math import isfinite
from typing import Any

import numpy as np

from stack.parameters import values_of
from stack.telemetry.outlines import largest_variance
from stack.telemetry.records import Snapshot, StageTiming, TreeRow
from stack.telemetry.tree_text import activity, depths
from stack.types import Twist

NUMBER, TEXT, FLAG = {"type": "number"}, {"type": "string"}, {"type": "boolean"}
OPEN = {"type": "object"}
"""A mapping whose names are not known in advance."""


def record(**fields: Mapping[str, Any]) -> dict[str, Any]:
    """The JSON Schema of an object with these fields."""
    return {"type": "object", "properties": fields}


def rows(**fields: Mapping[str, Any]) -> dict[str, Any]:
    """The JSON Schema of a list of objects with these fields."""
    return {"type": "array", "items": record(**fields)}


_TWIST = record(linear=NUMBER, lateral=NUMBER, angular=NUMBER)

SCHEMAS: dict[str, dict[str, Any]] = {
    "/status": record(
        state=TEXT, reason=TEXT, activity=TEXT, step=NUMBER, speed_factor=NUMBER,
        limitations=rows(effect=TEXT, cause=TEXT, detail=TEXT),
    ),
    "/motion": record(commanded=_TWIST, measured=_TWIST),
    "/localisation": record(health=NUMBER, deviation=NUMBER, error=NUMBER, rivals=NUMBER),
    "/battery": record(charge=NUMBER, voltage=NUMBER, charging=FLAG),
    "/compute": OPEN,
    "/counters": OPEN,
    "/blackboard": OPEN,
    "/parameters": OPEN,
    "/tree": record(
        nodes=rows(
            id=NUMBER, parent=NUMBER, depth=NUMBER, name=TEXT, kind=TEXT, status=TEXT,
            message=TEXT, since=NUMBER, glyph=TEXT,
        )
    ),
    "/events": record(
        number=NUMBER, step=NUMBER, time=NUMBER, level=TEXT, source=TEXT, kind=TEXT, text=TEXT,
        fields=OPEN,
    ),
}  # fmt: skip
"""The schema of each topic. Metres, radians, seconds; `/compute` in milliseconds."""


def status(snapshot: Snapshot) -> dict[str, Any]:
    """What the mission does, and why the velocity is limited."""
    return {
        "state": str(snapshot.state),
        "reason": snapshot.reason,
        "activity": activity(snapshot.tree),
        "step": snapshot.step,
        "speed_factor": snapshot.speed,
        "limitations": [
            {"effect": item.effect, "cause": item.cause, "detail": item.detail}
            for item in snapshot.limitations
        ],
    }


def motion(snapshot: Snapshot) -> dict[str, Any]:
    """The velocities in the base frame."""
    return {"commanded": _twist(snapshot.commanded), "measured": _twist(snapshot.measured)}


def localisation(snapshot: Snapshot) -> dict[str, Any]:
    """Health, standard deviation along the longer axis, and the true error, if it is known."""
    figures = {
        "health": snapshot.health,
        "deviation": max(0.0, largest_variance(snapshot.covariance)) ** 0.5,
        "rivals": len(snapshot.rivals),
    }
    if snapshot.truth is not None:
        figures["error"] = snapshot.pose.distance_to(snapshot.truth)
    return figures


def battery(snapshot: Snapshot) -> dict[str, Any]:
    """Charge in [0, 1] and volts."""
    found = snapshot.battery
    return {"charge": found.charge, "voltage": found.voltage, "charging": found.charging}


def compute(stages: Mapping[str, StageTiming]) -> dict[str, Any]:
    """Milliseconds of each stage: mean and worst."""
    return {
        name: {"mean": 1e3 * timing.mean, "worst": 1e3 * timing.worst}
        for name, timing in stages.items()
    }


def tree(nodes: tuple[TreeRow, ...]) -> dict[str, Any]:
    """All nodes in drawing order."""
    depth_of = depths(nodes)
    return {"nodes": [{**asdict(row), "depth": depth_of[row.id]} for row in nodes]}


def changing(snapshot: Snapshot) -> dict[str, tuple[object, Callable[[Any], Any]]]:
    """What is logged when it changes: by topic, and how it becomes an object."""
    return {
        "/tree": (snapshot.tree, tree),
        "/compute": (snapshot.stages, compute),
        "/counters": (snapshot.counters, dict),
        "/blackboard": (snapshot.blackboard, dict),
        "/parameters": (snapshot.parameters, dict),
    }


def finite(value: Any) -> Any:
    """A JSON value: records become objects, numbers that JSON lacks null, other values text."""
    if isinstance(value, float):
        return value if isfinite(value) else None
    if is_dataclass(value):
        return finite(values_of(value))
    if isinstance(value, np.ndarray):
        return finite(value.tolist())
    if isinstance(value, Mapping):
        return {str(name): finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return value if value is None or isinstance(value, bool | int) else str(value)


def _twist(twist: Twist) -> dict[str, float]:
    return {"linear": twist.linear, "lateral": twist.lateral, "angular": twist.angular}


EACH_TIME: Mapping[str, Callable[[Snapshot], Any]] = {
    "/status": status,
    "/motion": motion,
    "/localisation": localisation,
    "/battery": battery,
}
"""What is logged with each snapshot, by topic."""
