"""The first events of a run, and the functions through which parts emit theirs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from missions.execution.prepare import PreparedMission
from missions.trees.debugging import addresses
from missions.trees.mission_tree import MissionTree
from stack.telemetry.hub import Telemetry


def announce_warnings(plan: PreparedMission, telemetry: Telemetry) -> None:
    """Emit the warnings about files, and that the robot does not see if it has no range sensor."""
    for warning in (*plan.world.warnings, *plan.robot.warnings, *plan.warnings):
        where = f"{Path(warning.mark.file).name}:{warning.mark.line}"
        telemetry.emit("world", f"{where} {warning.sentence}", source="world", level="warning")
    if plan.recording is not None:
        for note in plan.recording.notes:
            text = f"{plan.recording.file.name}: {note}"
            telemetry.emit("recording", text, source="body", level="warning")
    robot = plan.robot
    if robot.drivetrain.moves and not (robot.all_lidars or robot.sonars):
        telemetry.emit(
            "safety",
            f"{robot.name} has no lidar and no sonar: it does not see obstacles and drives at most"
            f" {plan.choices['safety'].parameters.blind_speed:g} m/s",
            source="safety", level="warning",
        )  # fmt: skip


def announce_tree(telemetry: Telemetry, tree: MissionTree) -> None:
    """Emit the `tree` event: one row per node, so that later events can name nodes by number."""
    rows = [
        [node.id, node.parent, node.kind, node.names[0], node.where] for node in addresses(tree)
    ]
    telemetry.emit("tree", f"{len(rows)} nodes", source="tree", rows=rows)


def emitter(telemetry: Telemetry, source: str) -> Callable[..., None]:
    """Return the function through which a part of the stack emits its events."""

    def emit(kind: str, text: str, level: str = "info", **fields: Any) -> None:
        sender = "mission" if kind == "say" else source
        telemetry.emit(kind, text, source=sender, level=level, **fields)

    return emit


def tree_emitter(telemetry: Telemetry) -> Callable[..., None]:
    """Return the function through which a tree emits its events."""

    def emit(level: str, kind: str, text: str, fields: Mapping[str, Any]) -> None:
        telemetry.emit(kind, text, source="tree", level=level, **fields)

    return emit
