"""What a rover tells: which one it is, its mode, texts, parameters, and how well it is heard."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot
from typing import Any

from robots.mavlink.autopilots import ROVER_TYPES, Autopilot, identified
from robots.mavlink.texts import StatusTexts
from stack.mavlink.link import Received

AUTOPILOT_COMPONENT = 1
ARMED = 0x80
"""MAV_MODE_FLAG_SAFETY_ARMED."""

SIGNED = 0x01
"""MAVLINK_IFLAG_SIGNED."""

KEPT_TEXTS = 20

LONGEST_TRIP = 5.0
"""Seconds; an answer that took longer is one to somebody else."""

STEP_BACK = int(1e9)
"""Nanoseconds by which the autopilot's clock goes back only when it was restarted."""


@dataclass(slots=True)
class Rover:
    """The rover as its messages show it.

    Attributes:
        system: MAVLink id.
        autopilot: its kind.
        mode: name of its mode.
        armed: whether it is.
        heard: when its newest message came, seconds.
        beat: when its newest heartbeat came.
        speed: over ground, m/s.
        signs: whether its frames are signed.
    """

    system: int
    autopilot: Autopilot
    mode: str = ""
    armed: bool = False
    heard: float = 0.0
    beat: float = 0.0
    speed: float = 0.0
    signs: bool = False


@dataclass
class LinkFigures:
    """Measured figures of a link.

    Attributes:
        round_trips: of TIMESYNC messages, newest last, seconds.
        kinds: number of messages by kind.
        setpoints: sent so far.
        reopened: how often the connection was opened again.
        losses: how often the rover fell silent.
        restarts: how often its autopilot was restarted.
    """

    round_trips: deque[float] = field(default_factory=lambda: deque(maxlen=10_000))
    kinds: dict[str, int] = field(default_factory=dict)
    setpoints: int = 0
    reopened: int = 0
    losses: int = 0
    restarts: int = 0


class Hearing:
    """Notes what the messages of one rover tell.

    Args:
        own_system: our MAVLink id.
        system: id of the rover; 0: the first that is heard.
        autopilot: its kind; None: as its heartbeat says.
        acknowledged: gets the acknowledgements of our commands.

    Attributes:
        rover: None until it is found.
        others: systems of further rovers.
        values: parameters of the rover, by name.
        has_origin: whether it has a geodetic origin.
        figures: of the link.
        last_text: newest text of the autopilot; empty before the first.
    """

    def __init__(
        self, own_system: int, system: int, autopilot: Autopilot | None,
        acknowledged: Callable[[Any], None],
    ) -> None:  # fmt: skip
        self._own, self._system, self._autopilot = own_system, system, autopilot
        self.rover: Rover | None = None
        self.others: set[int] = set()
        self.values: dict[str, float] = {}
        self.has_origin, self.last_text = False, ""
        self.figures = LinkFigures()
        self._texts, self._new_texts = StatusTexts(), deque[str](maxlen=KEPT_TEXTS)
        self._rover_time = 0
        self._readers: dict[str, Callable[[Received, Rover], None]] = {
            "STATUSTEXT": self._status_text,
            "COMMAND_ACK": lambda item, _: self._acknowledged(item.message, acknowledged),
            "PARAM_VALUE": self._parameter,
            "LOCAL_POSITION_NED": self._speed,
            "GPS_GLOBAL_ORIGIN": self._origin,
            "TIMESYNC": self._timesync,
        }

    def take_texts(self) -> list[str]:
        """Return the autopilot's texts since the last call; from any thread."""
        texts = []
        with contextlib.suppress(IndexError):
            while True:
                texts.append(self._new_texts.popleft())
        return texts

    def takes(self, item: Received) -> bool:
        """Note what a message tells; return whether it is one of the rover."""
        if item.kind == "HEARTBEAT" and item.component == AUTOPILOT_COMPONENT:
            self._heartbeat(item)
        rover = self.rover
        if rover is None or item.system != rover.system:
            return False
        rover.heard = item.at
        kinds = self.figures.kinds
        kinds[item.kind] = kinds.get(item.kind, 0) + 1
        reader = self._readers.get(item.kind)
        if reader is not None:
            reader(item, rover)
        return True

    def _heartbeat(self, item: Received) -> None:
        message = item.message
        autopilot = self._autopilot or identified(message)
        if autopilot is None or message.type not in ROVER_TYPES:
            return
        if self._system not in (0, item.system):
            return
        if self.rover is None:
            self.rover = Rover(item.system, autopilot)
        rover = self.rover
        if item.system != rover.system:
            self.others.add(item.system)
            return
        rover.mode, rover.beat = autopilot.mode_of(message), item.at
        rover.armed = bool(message.base_mode & ARMED)
        rover.signs = bool(message.get_header().incompat_flags & SIGNED)

    def _status_text(self, item: Received, _: Rover) -> None:
        text = self._texts.add(item.message)
        if text:
            self.last_text = text
            self._new_texts.append(text)

    def _acknowledged(self, message: Any, acknowledged: Callable[[Any], None]) -> None:
        if message.target_system in (0, self._own):
            acknowledged(message)

    def _parameter(self, item: Received, _: Rover) -> None:
        self.values[str(item.message.param_id)] = float(item.message.param_value)

    def _speed(self, item: Received, rover: Rover) -> None:
        rover.speed = hypot(item.message.vx, item.message.vy)

    def _origin(self, item: Received, _: Rover) -> None:
        self.has_origin = True

    def _timesync(self, item: Received, _: Rover) -> None:
        message = item.message
        if message.tc1 == 0:
            return  # a question
        took = item.at - message.ts1 * 1e-9
        if not 0.0 <= took < LONGEST_TRIP:
            return
        self.figures.round_trips.append(took)
        if message.tc1 < self._rover_time - STEP_BACK:
            self.figures.restarts += 1
        self._rover_time = message.tc1
