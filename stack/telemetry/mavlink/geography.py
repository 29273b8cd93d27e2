"""Where the map is on Earth, and home."""

from __future__ import annotations

from math import cos, sin

from stack.errors import InputError
from stack.mavlink.origin import UNITS_PER_DEGREE, GeoOrigin
from stack.types import Pose2D, wrap_angle

GLOBAL_FRAMES = (0, 3, 5, 6)
"""MAV_FRAME_GLOBAL, _GLOBAL_RELATIVE_ALT, _GLOBAL_INT and _GLOBAL_RELATIVE_ALT_INT: all the same
for a robot on a floor."""

NO_ORIGIN = (
    "the map has no place on Earth: start with --origin LATITUDE,LONGITUDE, give the world file"
    " `origin`, or send SET_GPS_GLOBAL_ORIGIN"
)


class Geography:
    """Geodetic origin and home of a run.

    Attributes:
        origin: of the map; None: unknown. It is set once per run.
        home: pose on the map to return to; the start of the run unless a station sets it.
    """

    def __init__(self, origin: GeoOrigin | None) -> None:
        self.origin = origin
        self.home: Pose2D | None = None

    def set_origin(self, latitude: int, longitude: int, altitude: float) -> str:
        """Set the origin from 1e-7 degrees and metres; return why not."""
        if self.origin is not None:
            return "the origin is set already; it does not change during a run"
        try:
            origin = GeoOrigin(latitude / UNITS_PER_DEGREE, longitude / UNITS_PER_DEGREE, altitude)
        except InputError as error:
            return str(error)
        self.origin = origin
        return ""

    def place(self, latitude: int, longitude: int) -> tuple[float, float] | None:
        """x and y on the map of 1e-7 degrees; None without an origin."""
        return None if self.origin is None else self.origin.from_integers(latitude, longitude)

    def enu(self, pose: Pose2D) -> Pose2D:
        """A pose of the map in east-north-up axes through the map's origin."""
        east = 0.0 if self.origin is None else self.origin.east
        c, s = cos(east), sin(east)
        return Pose2D(
            c * pose.x + s * pose.y, c * pose.y - s * pose.x, wrap_angle(pose.heading - east)
        )

    def from_enu(self, x: float, y: float) -> tuple[float, float]:
        """x and y on the map of metres to the east and to the north of its origin."""
        east = 0.0 if self.origin is None else self.origin.east
        c, s = cos(east), sin(east)
        return c * x - s * y, s * x + c * y
