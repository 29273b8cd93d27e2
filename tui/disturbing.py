"""What an operator can do to a simulated world: the answers of the menu, and their commands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stack.telemetry.records import Snapshot

SHOVE = 0.3
"""Metres of a push."""

NEARLY_EMPTY = 0.15
"""Charge of a drained battery."""

LIFT = "lift_robot"


@dataclass(frozen=True, slots=True)
class Choice:
    """An answer of the menu.

    Attributes:
        text: for people.
        kind: of the command.
        arguments: of the command.
    """

    text: str
    kind: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


def choices(snapshot: Snapshot) -> list[Choice]:
    """What can be done now; each sensor is taken away, or given back if it delivers nothing."""
    found = [
        Choice("Drop a box before the robot", "drop_box"),
        Choice("Close or open the nearest door", "move_door"),
        Choice("Lift the robot to another place, on the map", LIFT),
        Choice("Push it to the left", "push_robot", {"left": SHOVE}),
        Choice("Push it back", "push_robot", {"forward": -SHOVE}),
        Choice("Turn it by half a right angle", "push_robot", {"turn": 0.785}),
        Choice(f"Drain the battery to {NEARLY_EMPTY:.0%}", "set_charge", {"charge": NEARLY_EMPTY}),
        Choice("Charge the battery", "set_charge", {"charge": 1.0}),
    ]
    for sensor in snapshot.sensors:
        if sensor.expected:
            silent = sensor.age > max(0.5, 5.0 / sensor.expected)
            words = "Give back" if silent else "Take away"
            arguments = {"name": sensor.name, "works": silent}
            found.append(Choice(f"{words} the sensor {sensor.name}", "silence_sensor", arguments))
    return found
