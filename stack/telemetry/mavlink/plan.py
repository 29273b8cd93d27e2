"""A plan: mission items as a station sent them, and their meaning for this robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.geography import GLOBAL_FRAMES, NO_ORIGIN, Geography
from stack.telemetry.records import Snapshot
from stack.types import INSCRIBED_COST, LETHAL_COST, CostGrid, OccupancyGrid

MAX_ITEMS = 500
WAYPOINT, LOITER, RETURN = 16, 19, 20
SPEED = 178
MOVING = (WAYPOINT, LOITER)
DRIVEN = (WAYPOINT, LOITER, RETURN, SPEED)
LONGEST_WAIT = 86400.0

OK, BAD_FRAME, UNKNOWN = (
    mav.MAV_MISSION_ACCEPTED, mav.MAV_MISSION_UNSUPPORTED_FRAME, mav.MAV_MISSION_UNSUPPORTED,
)  # fmt: skip
INVALID_PLACE, NOT_POSSIBLE = mav.MAV_MISSION_INVALID_PARAM5_X, mav.MAV_MISSION_ERROR
BAD_WAIT, BAD_SPEED = mav.MAV_MISSION_INVALID_PARAM1, mav.MAV_MISSION_INVALID_PARAM2


@dataclass(frozen=True, slots=True)
class Item:
    """One item of a plan, unchanged, so that it is downloaded as it was uploaded.

    Attributes:
        parameters: the first four; may be NaN.
        x: latitude in 1e-7 degrees.
        y: longitude in 1e-7 degrees.
        z: altitude, which is not used.
    """

    seq: int
    frame: int
    command: int
    parameters: tuple[float, float, float, float]
    x: int = 0
    y: int = 0
    z: float = 0.0
    autocontinue: int = 1

    @property
    def wait(self) -> float:
        """Seconds to stand after arriving."""
        return _number(self.parameters[0], 0.0)

    @property
    def radius(self) -> float | None:
        """Tolerance of the place, metres; None: the robot's."""
        given = _number(self.parameters[1], 0.0) if self.command == WAYPOINT else 0.0
        return max(given, 0.1) if given > 0.0 else None


Plan = Sequence[Item]


def _number(value: float, default: float) -> float:
    return value if isfinite(value) else default


def read_item(message: Any) -> Item:
    """The item of a MISSION_ITEM_INT, or of the older MISSION_ITEM with degrees."""
    x, y = message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        x, y = (round(v * 1e7) if isfinite(v) and abs(v) <= 180.0 else 0 for v in (x, y))
    parameters = message.param1, message.param2, message.param3, message.param4
    return Item(
        message.seq, message.frame, message.command, parameters, x, y, message.z,
        message.autocontinue,
    )  # fmt: skip


def is_home(item: Item, rule: str) -> bool:
    """Whether the first item of an uploaded plan is home, which is not driven to.

    Args:
        item: the first.
        rule: `auto`: a waypoint with absolute altitude, as MAVProxy and QGroundControl write for
            ArduPilot and MAVSDK does not; `always`; `never`.
    """
    return rule == "always" or (rule == "auto" and item.command == WAYPOINT and item.frame == 0)


class PlanCheck:
    """Checks items on arrival: what the robot can do, and where it can stand.

    Args:
        geography: origin of the map.
        snapshot: returns the newest state, with the maps.
    """

    def __init__(self, geography: Geography, snapshot: Callable[[], Snapshot | None]) -> None:
        self._geography, self._snapshot = geography, snapshot

    def problem(self, item: Item, *, home: bool = False) -> tuple[int, str]:
        """Result of MAV_MISSION_RESULT, and why an item is refused."""
        name = f"item {item.seq}"
        if home:
            return OK, ""
        if item.command not in DRIVEN:
            return UNKNOWN, f"{name}: command {item.command} is not supported in a plan"
        if item.command == SPEED:
            speed = item.parameters[1]
            good = not isfinite(speed) or speed > 0.0 or speed in (-1.0, -2.0)
            return (OK, "") if good else (BAD_SPEED, f"{name}: speed {speed:g} m/s is not positive")
        if item.command == RETURN:
            return OK, ""
        if item.frame not in GLOBAL_FRAMES:
            return BAD_FRAME, f"{name}: frame {item.frame} is not supported; use 0, 3, 5 or 6"
        if not 0.0 <= item.wait <= LONGEST_WAIT:
            return BAD_WAIT, f"{name}: a wait of {item.wait:g} s is not in 0..{LONGEST_WAIT:g}"
        return self._place_problem(item, name)

    def place_of(self, item: Item) -> tuple[float, float] | None:
        """x and y on the map; None: where the robot stands, or unknown."""
        if item.command == LOITER and item.x == 0 and item.y == 0:
            return None
        return self._geography.place(item.x, item.y)

    def _place_problem(self, item: Item, name: str) -> tuple[int, str]:
        if item.command == LOITER and item.x == 0 and item.y == 0:
            return OK, ""
        place = self.place_of(item)
        if place is None:
            return NOT_POSSIBLE, NO_ORIGIN
        problem = place_problem(self._snapshot(), *place)
        if not problem:
            return OK, ""
        return INVALID_PLACE, f"{name} at ({place[0]:.1f}, {place[1]:.1f}) m {problem}"


def place_problem(snapshot: Snapshot | None, x: float, y: float) -> str:
    """Why the robot cannot be at a place of the map: outside of it, or in an obstacle."""
    if snapshot is None:
        return "cannot be checked: the mission has not started"
    known = snapshot.layers.get("map")
    grid = known.content if known is not None else None
    if isinstance(grid, OccupancyGrid) and bool(np.any(grid.cells >= 0)):
        cell = grid.cell_at(x, y)
        if not grid.contains(*cell):
            return "is outside the map"
        if grid.occupied[cell]:
            return "is in an obstacle of the map"
    costs = snapshot.layers.get("global_costmap")
    field = costs.content if costs is not None else None
    if isinstance(field, CostGrid):
        cell = field.cell_at(x, y)
        if field.contains(*cell) and field.cells[cell] in (INSCRIBED_COST, LETHAL_COST):
            return "is too close to an obstacle"
    return ""
