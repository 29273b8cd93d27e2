"""Messages between an engine and its clients, in addition to the records.

The client polls: a Request lists what the client already has, and the engine answers once with
what is new, at most twenty times a second. Messages never queue up for a client that is slow or
gone. A lost answer does no harm: the next Request asks for the same data.

Commands are acknowledged, each on its own. A Goodbye frees the client's place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stack.telemetry.records import Ack, Command, Layer, MissionState, RunInfo, Snapshot
from stack.types import Image


@dataclass(frozen=True, slots=True)
class Request:
    """Request of a client for new data.

    Attributes:
        has_info: the client has the RunInfo.
        next_event: number of the first event that the client lacks.
        moment: number of the newest Moment that the client has, -1 for none.
        layers: versions of the layers that the client has, by name.
        pictures: the client shows the camera's pictures now; it gets an Image, small and at most
            twice a second.
    """

    has_info: bool = False
    next_event: int = 0
    moment: int = -1
    layers: Mapping[str, int] = field(default_factory=dict)
    pictures: bool = False


@dataclass(frozen=True, slots=True)
class Inquiry:
    """Question for the state of the run; answered once, with a RunState."""


@dataclass(frozen=True, slots=True)
class Goodbye:
    """The client leaves; nothing more is sent to it."""


@dataclass(frozen=True, slots=True)
class RunState:
    """Answer to an Inquiry.

    Attributes:
        identity: of the run.
        state: of the mission.
        time: on the robot's clock, seconds.
    """

    identity: str
    state: MissionState
    time: float


@dataclass(frozen=True, slots=True)
class NamedLayer:
    """A layer that the client lacks; sent before the Moment that refers to it."""

    name: str
    layer: Layer


@dataclass(frozen=True, slots=True)
class Moment:
    """A snapshot without pictures, and without its layers, which are referred to by version.

    Attributes:
        number: counts the snapshots of a run.
        layers: version by name; the contents are sent as NamedLayer, now or earlier.
    """

    number: int
    layers: Mapping[str, int]
    snapshot: Snapshot


@dataclass(frozen=True, slots=True)
class EventBatch:
    """Encoded events in order.

    Attributes:
        first: number of the first event. Larger than requested if older events were discarded.
        events: each encoded on its own when it happened.
    """

    first: int
    events: tuple[bytes, ...]


@dataclass(frozen=True, slots=True)
class Served:
    """End of the answer to a Request, also sent when nothing is new.

    Attributes:
        events: number of events so far; if the client has fewer, it requests again.
    """

    events: int


@dataclass(frozen=True, slots=True)
class Over:
    """The run has ended; no further messages follow."""

    report: Any


CLIENT_SENDS = (Request, Command, Inquiry, Goodbye)
SERVER_SENDS = (RunInfo, RunState, NamedLayer, Moment, Image, EventBatch, Served, Ack, Over)
