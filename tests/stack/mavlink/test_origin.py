from math import cos, hypot, pi, radians, sin, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.errors import InputError
from stack.mavlink.origin import EQUATORIAL_RADIUS, FLATTENING, GeoOrigin

place = st.floats(-1e4, 1e4)
origins = st.builds(
    GeoOrigin, st.floats(-80, 80), st.floats(-180, 180), st.just(0.0), st.floats(-pi, pi)
)


def on_ellipsoid(latitude, longitude):
    """Earth-centred coordinates of a place at height 0."""
    latitude, longitude = radians(latitude), radians(longitude)
    squared = FLATTENING * (2 - FLATTENING)
    n = EQUATORIAL_RADIUS / sqrt(1 - squared * sin(latitude) ** 2)
    return (
        n * cos(latitude) * cos(longitude), n * cos(latitude) * sin(longitude),
        n * (1 - squared) * sin(latitude),
    )  # fmt: skip


@given(origins, place, place)
def test_there_and_back(origin, x, y):
    assert origin.to_local(*origin.to_geodetic(x, y)) == pytest.approx((x, y), abs=1e-4)


@given(origins, place, place)
def test_integers_are_precise_to_a_centimetre(origin, x, y):
    u, v = origin.from_integers(*origin.to_integers(x, y))
    assert hypot(u - x, v - y) < 0.009  # half a unit is 5.6 mm in each of two directions


@pytest.mark.parametrize(("metres", "error"), [(100.0, 0.002), (1000.0, 0.2)])
@pytest.mark.parametrize(("x", "y"), [(1, 0), (0, 1), (0.7, 0.7), (-0.7, 0.7), (0.7, -0.7)])
def test_against_earth_centred_coordinates(metres, error, x, y):
    origin = GeoOrigin(48.0, 11.0)
    a = on_ellipsoid(48.0, 11.0)
    b = on_ellipsoid(*origin.to_geodetic(x * metres, y * metres))
    dx, dy, dz = (after - before for before, after in zip(a, b, strict=True))
    latitude, longitude = radians(48.0), radians(11.0)
    east = -sin(longitude) * dx + cos(longitude) * dy
    north = -sin(latitude) * (cos(longitude) * dx + sin(longitude) * dy) + cos(latitude) * dz
    assert hypot(east - x * metres, north - y * metres) < error


def test_a_map_may_be_turned():
    origin = GeoOrigin(48.0, 11.0, east=pi / 2)  # east is the map's y axis, so north is -x
    latitude, longitude = origin.to_geodetic(-100.0, 0.0)
    assert latitude > 48.0005 and longitude == pytest.approx(11.0, abs=1e-9)
    assert origin.from_enu(0.0) == pi / 2


def test_the_date_line_is_no_edge():
    origin = GeoOrigin(0.0, 179.9999)
    _, longitude = origin.to_geodetic(100.0, 0.0)
    assert -180.0 <= longitude < -179.99
    assert origin.to_local(0.0, longitude)[0] == pytest.approx(100.0)


@pytest.mark.parametrize(("latitude", "longitude"), [(91, 0), (0, 181), (float("nan"), 0)])
def test_impossible_places_are_refused(latitude, longitude):
    with pytest.raises(InputError, match="origin: l"):
        GeoOrigin(latitude, longitude)
