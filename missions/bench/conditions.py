"""What the results of a bench depend on, besides worlds and seeds."""

from __future__ import annotations

from dataclasses import asdict
from hashlib import sha256
from typing import Any

from missions.execution.prepare import PreparedMission, RunOptions


def conditions(plan: PreparedMission, options: RunOptions) -> dict[str, Any]:
    """Return mission, arguments, robot and parameters of a run, to be kept with the results."""
    chosen = {
        kind: {"use": choice.name, **asdict(choice.parameters)}
        for kind, choice in plan.choices.items()
    }
    return {
        "mission": digest(plan.text.encode()), "arguments": dict(options.arguments or {}),
        "robot": plan.robot.name, "limits": asdict(plan.robot.limits), "navigation": chosen,
    }  # fmt: skip


def world_of(plan: PreparedMission) -> str:
    """Return the content of a mission's world as a digest; the name of one without a file."""
    source = plan.world.source
    return plan.world.name if source is None else digest(source.read_bytes())


def digest(content: bytes) -> str:
    """Return a short digest of a content."""
    return sha256(content).hexdigest()[:16]
