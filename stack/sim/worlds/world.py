"""A simulated place: what stands in it, who walks in it, and what happens in it. Data only.

Everything is in the world frame, which is the map frame of a map made from the world.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path as FilePath

from stack.documents import Finding
from stack.types import FloatArray, Marker, Pose2D

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Wall:
    """A polyline of upright slabs. points (n, 2) metres, n >= 2; joints are filled."""

    points: FloatArray
    thickness: float = 0.1
    height: float = 1.0
    colour: Colour = (0.75, 0.77, 0.80)
    on_map: bool = True


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box: pose of its middle on the floor, size (length, width, height) metres."""

    pose: Pose2D
    size: tuple[float, float, float]
    colour: Colour = (0.55, 0.42, 0.32)
    on_map: bool = True
    name: str = ""


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder."""

    x: float
    y: float
    radius: float
    height: float = 1.0
    colour: Colour = (0.45, 0.55, 0.45)
    on_map: bool = True
    name: str = ""


@dataclass(frozen=True, slots=True)
class Door:
    """A sliding slab that closes a gap from `start` to `end` and vanishes when open.

    Maps show a door open. The timeline moves it by name.
    """

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    closed: bool = False
    thickness: float = 0.08
    height: float = 1.0
    colour: Colour = (0.60, 0.35, 0.25)


@dataclass(frozen=True, slots=True)
class FrictionZone:
    """A rectangle of floor with another friction coefficient: x_min, y_min, x_max, y_max."""

    bounds: tuple[float, float, float, float]
    friction: float


@dataclass(frozen=True, slots=True)
class Person:
    """Walks round a loop of waypoints.

    Attributes:
        name: for reports.
        waypoints: (n, 2) metres, n >= 2; from the last back to the first.
        speed: m/s.
        radius: metres.
        pause: seconds at each waypoint.
        start: share of the loop already walked at time 0, in [0, 1).
        yields: stops for a robot in the way; else walks on, whatever stands there.
    """

    name: str
    waypoints: FloatArray
    speed: float = 0.8
    radius: float = 0.2
    pause: float = 0.0
    start: float = 0.0
    yields: bool = True


@dataclass(frozen=True, slots=True)
class Dock:
    """Where a battery charges: within `radius` metres of the place, nearly standing."""

    x: float
    y: float
    radius: float = 0.35


@dataclass(frozen=True, slots=True)
class Trigger:
    """When a timeline entry happens: at a time, or when the robot's true position is in a circle.

    Attributes:
        time: seconds; with `near` it is the earliest time.
        near: (x, y, radius) metres, or None.
        after: seconds that pass between the trigger and the action.
    """

    time: float | None = None
    near: tuple[float, float, float] | None = None
    after: float = 0.0


@dataclass(frozen=True, slots=True)
class WorldEvent:
    """One timeline entry; exactly one of the actions is set. Happens once, at a step boundary."""

    trigger: Trigger
    open_door: str | None = None
    close_door: str | None = None
    move_robot: Pose2D | None = None
    battery: float | None = None


@dataclass(frozen=True, slots=True)
class World:
    """A place to drive in.

    Attributes:
        name: e.g. office.
        bounds: x_min, y_min, x_max, y_max of what a map covers, metres.
        markers: fiducial boards: a white board 1.25 times the marker's size, on a wall.
        places: named poses that missions may use; the mission's own come first.
        start: where a robot stands when the mission does not say.
        friction: of the floor where no zone says otherwise.
        source: the file it came from.
        warnings: what the reader of that file left out or replaced.
    """

    name: str
    bounds: tuple[float, float, float, float]
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    doors: tuple[Door, ...] = ()
    markers: tuple[Marker, ...] = ()
    friction_zones: tuple[FrictionZone, ...] = ()
    people: tuple[Person, ...] = ()
    docks: tuple[Dock, ...] = ()
    timeline: tuple[WorldEvent, ...] = ()
    places: dict[str, Pose2D] = field(default_factory=dict)
    start: Pose2D = Pose2D(0.0, 0.0)
    friction: float = 0.9
    source: FilePath | None = None
    warnings: tuple[Finding, ...] = ()
