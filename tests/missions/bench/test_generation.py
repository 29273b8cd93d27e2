"""Generated worlds: the robot reaches every room, nothing stands in doors, seeds repeat."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.bench.generation.floor_plan import LEAST_CLEARANCE, FloorPlan
from missions.bench.generation.worlds import KINDS, WorldOptions, generate
from missions.bench.shortest_path import shortest_path_lengths
from missions.execution.resources import MISSIONS, load_robot
from stack.errors import InputError
from stack.sim.people.loops import Walker
from stack.sim.worlds.world_file import read_world
from stack.types import Pose2D

ROBOT = load_robot("scout", MISSIONS)

SOME = st.builds(
    WorldOptions,
    kind=st.sampled_from(KINDS),
    seed=st.integers(0, 8999),
    rooms=st.sampled_from([0, 0, 4]),
    people=st.integers(0, 3),
    unmapped=st.sampled_from([0.0, 0.3, 1.0]),
)


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    folder = tmp_path_factory.mktemp("worlds")

    def read_plan(plan: FloorPlan):
        file = folder / "world.yaml"
        file.write_text(plan.text(), "utf-8")
        return read_world(file)

    return read_plan


@given(options=SOME)
@settings(max_examples=12, deadline=None)
def test_nothing_stands_in_a_doorway_and_no_furniture_overlaps(options):
    plan = generate(options)
    boxes = [(piece.corners.min(axis=0), piece.corners.max(axis=0)) for piece in plan.pieces]
    for opening in plan.openings:
        x_min, y_min, x_max, y_max = opening.zone(0.3)
        for low, high in boxes:
            assert low[0] >= x_max or high[0] <= x_min or low[1] >= y_max or high[1] <= y_min
    for (low, high), (low_2, high_2) in combinations(boxes, 2):
        assert (np.maximum(low - high_2, low_2 - high) > 0.0).any()


@pytest.mark.parametrize("kind", KINDS)
def test_the_planner_finds_a_way_to_every_place_past_all_furniture(read, kind):
    """With the inscribed radius of the robot, in the world as it is, unmapped pieces included."""
    for seed in (3, 4):
        plan = generate(WorldOptions(kind, seed, unmapped=0.3))
        world = read(plan)
        length = shortest_path_lengths(world, ROBOT, list(world.places.values()))
        for place in world.places.values():
            assert length(world.start, place) >= world.start.distance_to(place) - 0.1
        assert {room.name for room in plan.rooms} <= set(world.places)


def test_the_same_options_give_the_same_file_and_other_seeds_others():
    options = WorldOptions("flat", 7, people=3, unmapped=0.3)
    assert generate(options).text() == generate(options).text()
    assert generate(options).text() != generate(WorldOptions("flat", 8, people=3)).text()


def test_people_and_the_unmapped_share_leave_walls_and_furniture_as_they_are():
    bare, full = (
        generate(WorldOptions("office", 5, people=people, unmapped=share))
        for people, share in ((0, 0.0), (4, 0.3))
    )
    assert bare.walls == full.walls and bare.places == full.places
    assert [piece.pose for piece in bare.pieces] == [piece.pose for piece in full.pieces]
    hidden = sum(not piece.on_map for piece in full.pieces)
    assert hidden == round(0.3 * len(full.pieces))


def test_nobody_begins_at_the_start_of_the_robot(tmp_path):
    """A person who begins inside the robot throws it a metre away: flat 10 threw it so."""
    plan = generate(WorldOptions("flat", 10, people=4, unmapped=0.3))
    start = plan.places["room_2"]

    def nearest() -> float:
        file = tmp_path / "flat.yaml"
        file.write_text(plan.text())
        walkers = [Walker(person) for person in read_world(file).people]
        return min(start.distance_to(Pose2D(*walker.place)) for walker in walkers)

    assert nearest() < 0.3
    plan.keep_clear(start)
    # the way of that person, in a room of 3 m, stays within 0.6 m of the start
    assert len(plan.people) == 3
    assert nearest() >= LEAST_CLEARANCE


def test_a_twin_corridor_looks_the_same_after_half_a_turn_and_a_hotel_does_not():
    def outlines(plan, turn):
        x_min, y_min, x_max, y_max = plan.bounds
        middle = np.array([(x_min + x_max) / 2.0, (y_min + y_max) / 2.0])
        corners = [turn * (piece.corners.mean(axis=0) - middle) for piece in plan.pieces]
        return sorted(tuple((np.round(corner, 2) + 0.0).tolist()) for corner in corners)

    twin, hotel = generate(WorldOptions("twin", 3)), generate(WorldOptions("hotel", 3))
    assert outlines(twin, 1.0) == outlines(twin, -1.0)
    assert outlines(hotel, 1.0) != outlines(hotel, -1.0)
    assert {"printer", "plant"} <= {piece.name for piece in hotel.pieces}


def test_rooms_and_corridors_have_the_sizes_of_flats():
    for seed in range(6):
        plan = generate(WorldOptions("flat", seed))
        corridor, *rooms = plan.rooms
        assert 4 <= len(rooms) <= 10
        x_min, y_min, x_max, y_max = corridor.bounds
        assert 1.2 <= min(x_max - x_min, y_max - y_min) <= 2.0 + 1e-9
        assert all(0.8 <= opening.width <= 1.0 for opening in plan.openings)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (WorldOptions("castle", 1), "no kind of world 'castle'"),
        (WorldOptions("flat", 1, rooms=1), "--rooms 1: expected 2 to 40"),
        (WorldOptions("flat", 1, unmapped=1.5), "--unmapped 1.5"),
    ],
)
def test_options_out_of_range_are_refused(options, sentence):
    with pytest.raises(InputError, match=sentence):
        generate(options)
