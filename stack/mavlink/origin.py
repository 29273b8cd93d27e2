"""Geodetic origin: latitude and longitude of places on a map, by a plane that touches the Earth.

North and east are measured along the meridian and the parallel of the origin with the radii of
curvature of the WGS 84 ellipsoid there. Meridians converge, so the error grows with the square of
the distance: at 48 degrees of latitude 2 mm at 100 m, and 0.2 m at 1 km. The way back is exact:
both directions use the same plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, isfinite, radians, sin, sqrt

from stack.errors import InputError

EQUATORIAL_RADIUS, FLATTENING = 6378137.0, 1.0 / 298.257223563
"""WGS 84; metres."""

HIGHEST_LATITUDE = 85.0
"""Degrees: near a pole the plane has no use."""

UNITS_PER_DEGREE = 1e7
"""Messages carry latitude and longitude as integers of this unit (11 mm of latitude)."""


@dataclass(frozen=True, slots=True)
class GeoOrigin:
    """Where the origin of the map is on Earth.

    Attributes:
        latitude: degrees, north positive.
        longitude: degrees, east positive.
        altitude: metres above the mean sea level.
        east: direction of east on the map, radians anticlockwise from the map's x axis; 0: the
            map's x axis points east.
    """

    latitude: float
    longitude: float
    altitude: float = 0.0
    east: float = 0.0

    def __post_init__(self) -> None:
        if not abs(self.latitude) <= HIGHEST_LATITUDE:
            raise InputError(
                f"origin: latitude {self.latitude:g} is not in ±{HIGHEST_LATITUDE:g} degrees"
            )
        if not abs(self.longitude) <= 180.0:
            raise InputError(f"origin: longitude {self.longitude:g} is not in ±180 degrees")

    def to_geodetic(self, x: float, y: float) -> tuple[float, float]:
        """Latitude and longitude, degrees, of a place on the map, metres."""
        c, s = cos(self.east), sin(self.east)
        east, north = c * x + s * y, c * y - s * x
        along_meridian, along_parallel = self._metres_per_radian
        longitude = self.longitude + degrees(east / along_parallel)
        return self.latitude + degrees(north / along_meridian), _within_half_turn(longitude)

    def to_local(self, latitude: float, longitude: float) -> tuple[float, float]:
        """X and y on the map, metres, of a latitude and longitude, degrees."""
        along_meridian, along_parallel = self._metres_per_radian
        north = radians(latitude - self.latitude) * along_meridian
        east = radians(_within_half_turn(longitude - self.longitude)) * along_parallel
        c, s = cos(self.east), sin(self.east)
        return c * east - s * north, s * east + c * north

    def to_integers(self, x: float, y: float) -> tuple[int, int]:
        """Latitude and longitude as integers of 1e-7 degrees, as messages carry them."""
        latitude, longitude = self.to_geodetic(x, y)
        return round(latitude * UNITS_PER_DEGREE), round(longitude * UNITS_PER_DEGREE)

    def from_integers(self, latitude: int, longitude: int) -> tuple[float, float]:
        """X and y on the map of integers of 1e-7 degrees."""
        return self.to_local(latitude / UNITS_PER_DEGREE, longitude / UNITS_PER_DEGREE)

    def from_enu(self, heading: float) -> float:
        """Heading on the map of a heading from east, radians."""
        return heading + self.east

    @property
    def _metres_per_radian(self) -> tuple[float, float]:
        """Of latitude along the meridian, and of longitude along the parallel."""
        latitude = radians(self.latitude)
        squared = FLATTENING * (2.0 - FLATTENING)
        w = sqrt(1.0 - squared * sin(latitude) ** 2)
        return (
            EQUATORIAL_RADIUS * (1.0 - squared) / w**3,
            EQUATORIAL_RADIUS / w * cos(latitude),
        )


def read_origin(text: str) -> GeoOrigin:
    """Parse LATITUDE,LONGITUDE or LATITUDE,LONGITUDE,ALTITUDE, degrees and metres.

    Raises:
        InputError: it is not that, or out of range.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(map(isfinite, numbers)):
        raise InputError(
            f"origin {text!r}: expected LATITUDE,LONGITUDE in degrees: 48.1374,11.5755"
        )
    return GeoOrigin(*numbers)


def _within_half_turn(angle: float) -> float:
    """The same angle in degrees, in [-180, 180]."""
    return angle if abs(angle) <= 180.0 else (angle + 180.0) % 360.0 - 180.0
