"""Data model of a simulated world: obstacles, people, places and the timeline.

All coordinates are in the world frame, which is the map frame of a map made from the world.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot, pi, radians
from pathlib import Path as FilePath

from stack.documents import Finding
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

DOCK_HEIGHT, DOCK_COLOUR = 0.4, (0.2, 0.4, 0.35)


@dataclass(frozen=True, slots=True)
class Wall:
    """A polyline of upright slabs with filled joints. points: (n, 2) metres, n >= 2.

    Sonars measure glass; lidars and depth cameras see through it, cameras see a faint tint.
    A mirror reflects lidars and cameras at its upright faces, not at its joints; it cannot be of
    glass. A texture replaces the colour.
    """

    points: FloatArray
    thickness: float = 0.1
    height: float = 1.0
    colour: Colour = (0.75, 0.77, 0.80)
    on_map: bool = True
    glass: bool = False
    texture: str = "plain"
    mirror: bool = False


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box: pose of its centre on the floor, size (length, width, height) in metres.

    Its underside is `elevation` metres above the floor. The sides of a mirror reflect as those of
    a wall.
    """

    pose: Pose2D
    size: tuple[float, float, float]
    colour: Colour = (0.55, 0.42, 0.32)
    on_map: bool = True
    name: str = ""
    elevation: float = 0.0
    texture: str = "plain"
    mirror: bool = False

    def reaches(self, height: float) -> bool:
        """Return whether the box is at a height, metres above the floor."""
        return self.elevation <= height < self.elevation + self.size[2]


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder on the floor. x, y, radius and height in metres."""

    x: float
    y: float
    radius: float
    height: float = 1.0
    colour: Colour = (0.45, 0.55, 0.45)
    on_map: bool = True
    name: str = ""


@dataclass(frozen=True, slots=True)
class Door:
    """A slab that closes the gap from `start` to `end` and is removed when open.

    Maps show doors open. The timeline refers to a door by its name.
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
    """A rectangle of floor with its own friction coefficient: x_min, y_min, x_max, y_max."""

    bounds: tuple[float, float, float, float]
    friction: float


@dataclass(frozen=True, slots=True)
class Drop:
    """A rectangle without floor, such as a stairwell: x_min, y_min, x_max, y_max, and its depth.

    The simulated robot does not fall: driving into a drop is a contact.
    """

    bounds: tuple[float, float, float, float]
    depth: float
    name: str = ""

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
    width: float = 0.05
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
    speed: float = 0.8
    radius: float = 0.2
    pause: float = 0.0
    start: float = 0.0
    yields: bool = True
    model: str = "loop"
    attention: float = 1.0
    group: str = ""
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
    radius: float = 0.35
    facing: float | None = None

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
    over: float = 0.5
    frame: str = "robot"


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
    friction: float = 0.9
    floor: str = "plain"
    light: float = 1.0
    source: FilePath | None = None
    warnings: tuple[Finding, ...] = ()
