"""Generated offices with posters: what the benchmark of places relies on."""

import numpy as np
import pytest

from tests.benchmarks.place_offices import CLEARANCE_CHECKED, PosterOffice


@pytest.fixture(scope="module")
def offices(tmp_path_factory):
    folder = tmp_path_factory.mktemp("offices")
    return [(office, office.write(folder).world) for office in map(PosterOffice, (41, 42))]


def test_two_offices_share_no_picture_and_have_enough_of_them(offices):
    (_, one), (_, other) = offices
    for world in (one, other):
        assert len(world.posters) >= 20 and not world.markers
        assert {wall.texture for wall in world.walls} == {"wallpaper"}
    assert not {p.number for p in one.posters} & {p.number for p in other.posters}


def test_a_poster_hangs_on_something_and_faces_a_free_place(offices):
    for office, world in offices:
        solid = [np.array([box.pose.x, box.pose.y]) for box in world.boxes]
        assert solid
        for poster in world.posters:
            x, y, height = poster.position
            # Heights are rounded to a centimetre; furniture is up to 2 m high.
            assert 0.09 <= height - poster.size[1] / 2 and height + poster.size[1] / 2 <= 2.0
            ahead = np.array([x, y]) + 0.29 * np.array(
                [np.cos(poster.heading), np.sin(poster.heading)]
            )
            assert office.clearance_at(ahead) >= CLEARANCE_CHECKED - 0.05  # a cell


def test_the_tour_stops_in_every_room_and_the_poses_are_drawn_from_the_seed(offices):
    office, _ = offices[0]
    stops = office.tour()
    for room in office.plan.rooms:
        x_min, y_min, x_max, y_max = room.bounds
        assert any(x_min < stop.x < x_max and y_min < stop.y < y_max for stop in stops)
    assert office.poses(5, 0.3) == PosterOffice(41).poses(5, 0.3)
    assert all(office.clearance_at((pose.x, pose.y)) >= 0.25 for pose in office.poses(20, 0.3))
