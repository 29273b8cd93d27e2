"""Data model of a simulated world: obstacles, people, places and the timeline.

All coordinates are in the world frame, which is the map frame of a map made from the world.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot, pi, radians
from pathlib import Path as FilePath

from stack.documents import Finding
from stack.mavlink.origin import GeoOrigin
from stack.parameters import parameter
from stack.sim.faults.planned import PlannedFault
from stack.types import DockShape, FloatArray, Marker, Pose2D, wrap_angle

Colour = tuple[float, float, float]

TEXTURES = ("plain", "wallpaper", "wood", "brick", "carpet", "tiles")
"""Of walls, boxes and floors; `plain` shows the colour (stack/sim/physics/textures.py)."""

PERSON_HEIGHT = 1.7
"""Metres."""

POSTER = (0.6, 0.45)
"""Width and height of a poster, metres, unless its file says otherwise."""

CONTACT_GAP, CONTACT_ASIDE, CONTACT_ANGLE = (-0.005, 0.04), 0.02, radians(4.0)
"""Gap between a robot's front and the face of a dock, metres to the side, and radians, within which
its sprung contacts touch."""

NAME, ON_MAP = "name in messages", "show it on maps made from the world"
MIRROR = "reflects lidars and cameras; solid to sonars, bumpers and maps"

DOCK_HEIGHT, DOCK_COLOUR = 0.4, (0.2, 0.4, 0.35)


def _height() -> float:
    return parameter(1.0, "m", above=0.0, at_most=20.0, help="height above the floor")


def _texture(help: str) -> str:
    return parameter("plain", one_of=TEXTURES, help=help)


@dataclass(frozen=True, slots=True)
class Wall:
    """A polyline of upright slabs with filled joints. points: (n, 2) metres, n >= 2.

    Sonars measure glass; lidars and depth cameras see through it, cameras see a faint tint.
    A mirror reflects lidars and cameras at its upright faces, not at its joints; it cannot be of
    glass. A texture replaces the colour.
    """

    points: FloatArray
    thickness: float = parameter(
        0.1, "m", at_least=0.01, at_most=10.0, help="thickness of the slab"
    )
    height: float = _height()
    colour: Colour = (0.75, 0.77, 0.80)
    on_map: bool = parameter(True, help=ON_MAP)
    glass: bool = parameter(
        False, help="of glass: sonars measure it, lidars and depth cameras do not"
    )
    texture: str = _texture("picture that covers it instead of the colour; only cameras see it")
    mirror: bool = parameter(False, help=MIRROR)


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box: pose of its centre on the floor, size (length, width, height) in metres.

    Its underside is `elevation` metres above the floor. The sides of a mirror reflect as those of
    a wall.
    """

    pose: Pose2D
    size: tuple[float, float, float]
    colour: Colour = (0.55, 0.42, 0.32)
    on_map: bool = parameter(True, help=ON_MAP)
    name: str = parameter("", help=NAME)
    elevation: float = parameter(
        0.0, "m", at_least=0.0, at_most=20.0, help="height of its underside above the floor"
    )
    texture: str = _texture("picture that covers it instead of the colour; only cameras see it")
    mirror: bool = parameter(False, help=MIRROR)

    def reaches(self, height: float) -> bool:
        """Return whether the box is at a height, metres above the floor."""
        return self.elevation <= height < self.elevation + self.size[2]


@dataclass(frozen=True, slots=True)
class Block:
    """A box that arms can move: pose of its centre at time 0, size as of a box, metres.

    Lidars, sonars and maps do not show it; cameras do.
    """

    name: str
    pose: Pose2D
    size: tuple[float, float, float]
    colour: Colour = (0.80, 0.20, 0.15)
    elevation: float = parameter(
        0.0, "m", at_least=0.0, at_most=20.0, help="height of its underside above the floor"
    )
    mass: float = parameter(0.1, "kg", above=0.0, at_most=1000.0, help="mass")
    friction: float = parameter(1.0, at_least=0.0, at_most=2.0, help="Coulomb friction coefficient")


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder on the floor. x, y, radius and height in metres."""

    x: float
    y: float
    radius: float
    height: float = _height()
    colour: Colour = (0.45, 0.55, 0.45)
    on_map: bool = parameter(True, help=ON_MAP)
    name: str = parameter("", help=NAME)


@dataclass(frozen=True, slots=True)
class Door:
    """A slab that closes the gap from `start` to `end` and is removed when open.

    Maps show doors open. The timeline refers to a door by its name.
    """

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    closed: bool = parameter(False, help="closed at time 0")
    thickness: float = parameter(
        0.08, "m", at_least=0.01, at_most=1.0, help="thickness of the slab"
    )
    height: float = _height()
    colour: Colour = (0.60, 0.35, 0.25)


@dataclass(frozen=True, slots=True)
class FrictionZone:
    """A rectangle of floor with its own friction coefficient: x_min, y_min, x_max, y_max."""

    bounds: tuple[float, float, float, float]
    friction: float


@dataclass(frozen=True, slots=True)
class Shadow:
    """A rectangle, x_min, y_min, x_max, y_max, in whose column of air things have less light."""

    bounds: tuple[float, float, float, float]
    light: float = parameter(
        0.4, at_least=0.0, at_most=1.0, help="share of the world's light; only cameras see it"
    )


@dataclass(frozen=True, slots=True)
class Drop:
    """A rectangle without floor, such as a stairwell: x_min, y_min, x_max, y_max, and its depth.

    The simulated robot does not fall: driving into a drop is a contact.
    """

    bounds: tuple[float, float, float, float]
    depth: float = parameter(0.2, "m", above=0.0, at_most=20.0, help="depth below the floor")
    name: str = parameter("", help=NAME)

    def contains(self, points: FloatArray) -> bool:
        """Return whether one of the points (n, 2) is over the drop."""
        x_min, y_min, x_max, y_max = self.bounds
        inside = (points > (x_min, y_min)) & (points < (x_max, y_max))
        return bool(inside.all(axis=1).any())


@dataclass(frozen=True, slots=True)
class FloorLine:
    """A line painted on the floor: only cameras see it.

    Attributes:
        points: (n, 2) metres along its centre, n >= 2, with rounded corners.
        width: metres.
        colour: of the paint.
    """

    points: FloatArray
    width: float = parameter(0.05, "m", at_least=0.01, at_most=1.0, help="width of the paint")
    colour: Colour = (0.05, 0.05, 0.05)


@dataclass(frozen=True, slots=True)
class Poster:
    """A picture on a wall: only cameras see it.

    Attributes:
        number: the same number is the same picture in every world.
        position: (x, y, z) of its centre, metres.
        heading: direction it faces, radians.
        size: (width, height), metres.
    """

    number: int
    position: tuple[float, float, float]
    heading: float
    size: tuple[float, float] = POSTER


@dataclass(frozen=True, slots=True)
class Person:
    """A person who walks.

    Attributes:
        name: for reports.
        waypoints: (n, 2) metres; after the last follows the first. At least two for a `loop`.
        speed: m/s.
        radius: metres.
        pause: seconds at each waypoint.
        start: position at time 0 as a fraction of the loop, or of the list of waypoints of a
            person with social forces, in [0, 1).
        yields: in a `loop`: stops for a robot ahead; otherwise walks into it.
        model: `loop`: along straight lines from waypoint to waypoint; `social_force`: round
            obstacles, at a distance from people and robots; `recorded`: along a track.
        attention: share of the time in which a person with social forces watches the robots.
        group: name of a group that stays together, among people with social forces; empty: alone.
        track: (n, 5) seconds, x, y, metres, and velocity, m/s, of a recorded person.
        recorded_duration: seconds of the whole recording, after which it begins again.
    """

    name: str
    waypoints: FloatArray
    speed: float = parameter(0.8, "m/s", above=0.0, at_most=3.0, help="walking speed")
    radius: float = parameter(0.2, "m", above=0.0, at_most=1.0, help="radius of the body")
    pause: float = parameter(0.0, "s", at_least=0.0, help="pause at each waypoint")
    start: float = parameter(0.0, at_least=0.0, at_most=0.999, help="fraction of the loop")
    yields: bool = parameter(True, help="stop for a robot ahead")
    model: str = parameter(
        "loop", one_of=("loop", "social_force", "recorded"), help="how the person walks"
    )
    attention: float = parameter(
        1.0, at_least=0.0, at_most=1.0,
        help="share of the time in which the person watches the robots",
    )  # fmt: skip
    group: str = parameter("", help="people who stay together")
    track: FloatArray | None = None
    recorded_duration: float = 0.0


@dataclass(frozen=True, slots=True)
class Dock:
    """A charging station.

    Without a direction it charges every robot that stands within `radius` of it. With one it is a
    block with contacts: it charges a robot whose front is at its face.

    Attributes:
        x: metres; of a block the middle of its face.
        y: metres.
        radius: metres.
        facing: direction out of the face, radians.
    """

    x: float
    y: float
    radius: float = parameter(
        0.35, "m", above=0.0, at_most=5.0, help="distance within which a robot charges"
    )
    facing: float | None = parameter(None, "rad", help="direction out of its face")

    def charges(self, robot: Pose2D, front: float) -> bool:
        """Return whether a robot is charged that stands at a pose.

        Args:
            robot: map frame.
            front: distance from its base to its front, metres.
        """
        if self.facing is None:
            return hypot(robot.x - self.x, robot.y - self.y) <= self.radius
        local = robot.relative_to(Pose2D(self.x, self.y, self.facing))
        return (
            CONTACT_GAP[0] <= local.x - front <= CONTACT_GAP[1]
            and abs(local.y) <= CONTACT_ASIDE
            and abs(wrap_angle(local.heading - pi)) <= CONTACT_ANGLE
        )

    def boxes(self) -> tuple[Box, ...]:
        """Return the boxes of the block; none without a direction."""
        if self.facing is None:
            return ()
        shape, pose = DockShape(), Pose2D(self.x, self.y, self.facing)
        post = (shape.width - shape.slot_width) / 2.0
        aside = (shape.slot_width + post) / 2.0
        back = shape.depth - shape.slot_depth
        parts = (
            (-shape.slot_depth - back / 2.0, 0.0, back, shape.width),
            (-shape.slot_depth / 2.0, aside, shape.slot_depth, post),
            (-shape.slot_depth / 2.0, -aside, shape.slot_depth, post),
        )
        return tuple(
            Box(pose.compose(Pose2D(x, y)), (length, width, DOCK_HEIGHT), DOCK_COLOUR, name="dock")
            for x, y, length, width in parts
        )


@dataclass(frozen=True, slots=True)
class Trigger:
    """Condition of a timeline entry: a time, or the robot's true position in a circle, or both.

    Attributes:
        time: seconds; together with `near` the earliest time.
        near: (x, y, radius) metres, or None.
        after: delay between trigger and action, seconds.
    """

    time: float | None = None
    near: tuple[float, float, float] | None = None
    after: float = 0.0


@dataclass(frozen=True, slots=True)
class Push:
    """A displacement of the robot's body that its wheels do not measure.

    Attributes:
        by: metres and radians; added to the motion of the drive. Obstacles stop it.
        over: duration, seconds.
        frame: `robot`: `by` is in the base frame at the begin; `map`: in the world frame.
    """

    by: Pose2D
    over: float = parameter(0.5, "s", at_least=0.05, at_most=60.0, help="duration of the push")
    frame: str = parameter(
        "robot", one_of=("robot", "map"), help="frame of `by`: the base at the begin, or the map"
    )


@dataclass(frozen=True, slots=True)
class WorldEvent:
    """One timeline entry with exactly one action. Happens once, between two steps."""

    trigger: Trigger
    open_door: str | None = None
    close_door: str | None = None
    move_robot: Pose2D | None = None
    push: Push | None = None
    battery: float | None = None


@dataclass(frozen=True, slots=True)
class World:
    """A simulated world.

    Attributes:
        name: e.g. office.
        bounds: x_min, y_min, x_max, y_max of the area that a map covers, metres.
        markers: fiducial markers, each on a white board 1.25 times its size.
        places: named poses for missions; places of the mission take precedence.
        start: start pose of the robot when the mission has none.
        friction: friction coefficient of the floor outside the friction zones.
        posters: pictures on walls.
        floor: texture of the floor, one of TEXTURES.
        light: brightness of camera pictures: 1 normal; above it bright surfaces saturate.
        origin: place of the world frame's origin on Earth; None: unknown.
        faults: that befall every robot in it.
        source: the file that the world was read from.
        warnings: elements of that file that were ignored or replaced.
    """

    name: str
    bounds: tuple[float, float, float, float]
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    doors: tuple[Door, ...] = ()
    markers: tuple[Marker, ...] = ()
    friction_zones: tuple[FrictionZone, ...] = ()
    drops: tuple[Drop, ...] = ()
    lines: tuple[FloorLine, ...] = ()
    posters: tuple[Poster, ...] = ()
    people: tuple[Person, ...] = ()
    docks: tuple[Dock, ...] = ()
    timeline: tuple[WorldEvent, ...] = ()
    places: dict[str, Pose2D] = field(default_factory=dict)
    start: Pose2D = Pose2D(0.0, 0.0)
    friction: float = parameter(0.9, at_least=0.0, at_most=2.0, help="Coulomb friction coefficient")
    floor: str = _texture("texture of the floor; only cameras see it")
    light: float = parameter(
        1.0, at_least=0.0, at_most=10.0,
        help="brightness of camera pictures; above 1 bright surfaces saturate",
    )  # fmt: skip
    origin: GeoOrigin | None = None
    source: FilePath | None = None
    warnings: tuple[Finding, ...] = ()
    blocks: tuple[Block, ...] = ()
    shadows: tuple[Shadow, ...] = ()
    faults: tuple[PlannedFault, ...] = ()
