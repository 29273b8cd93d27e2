"""`treepilot mavlink`: who is on a MAVLink address, and what is sent how often."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from time import monotonic  # noqa: TID251 - the link's clock
from typing import Any

from robots.mavlink.autopilots import ROVER_TYPES, identified
from stack.columns import columns
from stack.errors import InputError
from stack.mavlink.address import read_address
from stack.mavlink.link import Link, Received, opening_problem

OWN_SYSTEM, OWN_COMPONENT = 245, 191
NO_AUTOPILOT, VERSION = 8, 148
WAIT = 0.1


@dataclass
class Component:
    """A component that was heard.

    Attributes:
        system, component: MAVLink ids.
        kind, autopilot, mode, version: for people; empty if they are not known.
        armed: whether it is.
        counts: number of messages by name.
    """

    system: int
    component: int
    kind: str = ""
    autopilot: str = ""
    mode: str = ""
    version: str = ""
    armed: bool = False
    counts: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Heard:
    """What was heard on an address.

    Attributes:
        seconds: for which it was listened.
        components: by ids.
        missed, refused: messages lost on the way, and damaged or unknown frames.
    """

    seconds: float
    components: tuple[Component, ...]
    missed: int
    refused: int

    def plain(self) -> dict[str, Any]:
        """Return it for JSON; rates in Hz."""
        return {
            "seconds": self.seconds, "missed": self.missed, "refused": self.refused,
            "components": [
                {
                    "system": one.system, "component": one.component, "type": one.kind,
                    "autopilot": one.autopilot, "version": one.version, "mode": one.mode,
                    "armed": one.armed,
                    "messages": {
                        name: round(count / self.seconds, 2)
                        for name, count in sorted(one.counts.items())
                    },
                }
                for one in self.components
            ],
        }  # fmt: skip

    def lines(self) -> Iterator[str]:
        """Yield lines for people."""
        for one in self.components:
            what = [one.kind or "no heartbeat", one.autopilot, one.version, one.mode]
            armed = "armed" if one.armed else ""
            words = ", ".join(word for word in (*what, armed) if word)
            yield f"system {one.system}, component {one.component}: {words}"
            rows = [
                (f"    {name}", f"{count / self.seconds:6.1f} Hz")
                for name, count in sorted(one.counts.items())
            ]
            yield from columns(rows)
        if self.missed or self.refused:
            yield f"{self.missed} messages lost on the way, {self.refused} damaged or unknown"


def listen(address: str, seconds: float) -> Heard:
    """Listen on an address; send heartbeats, so that those who answer only callers are heard.

    Args:
        address: as stack.mavlink.address reads it.
        seconds: of listening.

    Raises:
        InputError: the address is wrong or cannot be opened.
    """
    read = read_address(address)
    try:
        link = Link(read, system=OWN_SYSTEM, component=OWN_COMPONENT, clock=monotonic)
    except OSError as error:
        raise InputError(opening_problem(read, error)) from None
    found: dict[tuple[int, int], Component] = {}
    began, beat = monotonic(), 0.0
    try:
        while (now := monotonic()) < began + seconds:
            if now >= beat:
                beat = now + 1.0
                link.send(
                    link.dialect.MAVLink_heartbeat_message(
                        link.dialect.MAV_TYPE_ONBOARD_CONTROLLER, NO_AUTOPILOT, 0, 0, 4, 3
                    )
                )
            for item in link.receive(WAIT):
                _note(found, item, link)
    except OSError as error:
        raise InputError(opening_problem(read, error)) from None
    finally:
        link.close()
    counters = link.counters
    components = tuple(found[ids] for ids in sorted(found))
    return Heard(seconds, components, counters.missed, counters.refused)


def _note(found: dict[tuple[int, int], Component], item: Received, link: Link) -> None:
    ids = item.system, item.component
    one = found.setdefault(ids, Component(*ids))
    one.counts[item.kind] = one.counts.get(item.kind, 0) + 1
    message = item.message
    if item.kind == "HEARTBEAT":
        is_new = not one.kind
        _describe(one, message, link.dialect)
        if is_new and message.autopilot != NO_AUTOPILOT:
            d = link.dialect
            link.send(
                d.MAVLink_command_long_message(
                    *ids, d.MAV_CMD_REQUEST_MESSAGE, 0, VERSION, 0, 0, 0, 0, 0, 0
                )
            )
    elif item.kind == "AUTOPILOT_VERSION":
        number = message.flight_sw_version
        one.version = ".".join(str(number >> shift & 0xFF) for shift in (24, 16, 8))


def _describe(one: Component, heartbeat: Any, dialect: Any) -> None:
    one.kind = _word(dialect, "MAV_TYPE", heartbeat.type)
    one.armed = bool(heartbeat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
    if heartbeat.autopilot == NO_AUTOPILOT:
        return
    one.autopilot = _word(dialect, "MAV_AUTOPILOT", heartbeat.autopilot)
    known = identified(heartbeat)
    if known is not None and heartbeat.type in ROVER_TYPES:
        one.mode = known.mode_of(heartbeat)
    else:
        one.mode = f"mode {heartbeat.custom_mode}"


def _word(dialect: Any, enumeration: str, number: int) -> str:
    """GROUND_ROVER as `ground rover`."""
    entry = dialect.enums[enumeration].get(number)
    if entry is None:
        return f"{enumeration} {number}"
    return str(entry.name).removeprefix(f"{enumeration}_").replace("_", " ").lower()
