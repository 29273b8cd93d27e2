"""What an engine and its dashboards say to each other, besides the records themselves.

The client asks, the engine answers: a Request names all that the client already has, and is
answered once, by what is new, at most twenty times a second. Nothing ever queues up for a client
that is slow or gone, and a lost answer costs nothing: the next Request says the same again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stack.telemetry.records import Ack, Command, Layer, RunInfo, Snapshot


@dataclass(frozen=True, slots=True)
class Request:
    """A client wants to hear what is new.

    Attributes:
        has_info: it knows the RunInfo.
        next_event: number of the first event it lacks.
        moment: number of the newest Moment it has, -1 for none.
        layers: versions of the layers it has, by name.
        images: it wants camera pictures.
    """

    has_info: bool = False
    next_event: int = 0
    moment: int = -1
    layers: Mapping[str, int] = field(default_factory=dict)
    images: bool = False


@dataclass(frozen=True, slots=True)
class NamedLayer:
    """A layer that the client lacks; comes before the Moment that shows it."""

    name: str
    layer: Layer


@dataclass(frozen=True, slots=True)
class Moment:
    """A snapshot without its layers, which are named by version.

    Attributes:
        number: counts the snapshots of a run.
        layers: version by name; the contents came as NamedLayer, now or earlier.
    """

    number: int
    layers: Mapping[str, int]
    snapshot: Snapshot


@dataclass(frozen=True, slots=True)
class EventBatch:
    """Events in order, each encoded by itself when it happened.

    Attributes:
        first: number of the first. Above the number asked for when older ones are forgotten.
    """

    first: int
    events: tuple[bytes, ...]


@dataclass(frozen=True, slots=True)
class Served:
    """The answer to a Request is complete, even if there was nothing new.

    Attributes:
        events: how many events there have been; more than have come so far: ask again.
    """

    events: int


@dataclass(frozen=True, slots=True)
class Over:
    """The run has ended; nothing comes any more."""

    report: Any


CLIENT_SENDS = (Request, Command)
SERVER_SENDS = (RunInfo, NamedLayer, Moment, EventBatch, Served, Ack, Over)
