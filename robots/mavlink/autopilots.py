"""What differs between the autopilots: modes and their numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ARDUPILOT, PX4 = 3, 12
"""MAV_AUTOPILOT numbers."""

ROVER_TYPES = (10, 11)
"""MAV_TYPE of ground rovers and boats: what ArduRover and PX4's rovers announce."""

CUSTOM_MODE = 1
"""MAV_MODE_FLAG_CUSTOM_MODE_ENABLED."""


@dataclass(frozen=True)
class Autopilot:
    """An autopilot.

    Attributes:
        name: for people.
        driving: name of the mode in which it obeys velocity setpoints.
        modes: names of modes by number, as `mode_of` returns them.
        streams_first: seconds of setpoints that it wants to see before it accepts that mode.
        stops_after: what stops it when setpoints end, for people.
        read: parameters that the checks of the body know.
    """

    name: str
    driving: str
    modes: dict[int, str]
    streams_first: float
    stops_after: str
    read: tuple[str, ...]

    @property
    def driving_number(self) -> int:
        """Number of the driving mode."""
        return next(number for number, name in self.modes.items() if name == self.driving)

    def mode_of(self, heartbeat: Any) -> str:
        """Name of the mode in a heartbeat."""
        number = int(heartbeat.custom_mode)
        if self is PX4_ROVER:
            number = number >> 16 & 0xFF
        return self.modes.get(number, f"mode {number}")


ARDUROVER = Autopilot(
    "ArduRover",
    "GUIDED",
    {
        0: "MANUAL", 1: "ACRO", 3: "STEERING", 4: "HOLD", 5: "LOITER", 6: "FOLLOW", 7: "SIMPLE",
        8: "DOCK", 9: "CIRCLE", 10: "AUTO", 11: "RTL", 12: "SMART_RTL", 15: "GUIDED",
        16: "INITIALISING",
    },
    streams_first=0.0,
    stops_after="3 s without a setpoint",
    read=("FS_GCS_ENABLE", "MAV_GCS_SYSID", "SYSID_MYGCS"),
)  # fmt: skip

PX4_ROVER = Autopilot(
    "PX4",
    "OFFBOARD",
    {
        1: "MANUAL", 2: "ALTITUDE", 3: "POSITION", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD",
        7: "STABILIZED", 8: "RATTITUDE", 9: "SIMPLE",
    },
    streams_first=1.2,
    stops_after="COM_OF_LOSS_T without a setpoint",
    read=("COM_OF_LOSS_T",),
)  # fmt: skip

BY_NUMBER = {ARDUPILOT: ARDUROVER, PX4: PX4_ROVER}
BY_NAME = {"ardupilot": ARDUROVER, "px4": PX4_ROVER}


def identified(heartbeat: Any) -> Autopilot | None:
    """The autopilot of a heartbeat; None for one that is not known."""
    return BY_NUMBER.get(int(heartbeat.autopilot))
