"""Layers by hand: painting, provenance, clearing, and partial against complete repaints."""

from dataclasses import replace
from math import exp, inf, pi, sqrt, tanh

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import available, component
from stack.costmap.choosing import for_lidars, read_layers, usual_layers, with_sensors
from stack.costmap.costmap import Costmap
from stack.costmap.layer import CellProvenance, Layer, edges
from stack.costmap.parameters import CostmapParameters
from stack.errors import InputError, ParameterError
from stack.types import (
    FREE_COST,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN_COST,
    Pose2D,
    RangeReading,
    TrackedObject,
)
from tests.stack.costmap.marks import seen, sensed
from tests.stack.costmap.test_costmap import ONLY_CELLS, ROUND, TINY, at, room, scan
from tests.stack.mapping.written_maps import write_ros_map

SQUARE = [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0]]


def made(*layers, parameters=ONLY_CELLS, footprint=TINY, static=None, window=None):
    static = room() if static is None and window is None else static
    return Costmap(
        parameters, footprint, static, window=window, layers=read_layers(layers, parameters)
    )


def walker(x, y, speed_x, speed_y=0.0, radius=0.25, stamp=0.0):
    return TrackedObject(1, stamp, (x, y), (speed_x, speed_y), radius, np.eye(4))


def sonar(distance, opening=pi / 6):
    return RangeReading(0.0, distance, opening, 0.02, 4.0, source="front_sonar")


def test_every_named_layer_can_be_made_and_describes_itself():
    for name in available("costmap_layer"):
        cls = component("costmap_layer", name)
        assert cls.__doc__ and issubclass(cls, Layer)


class Puddle(Layer):
    """A plugin layer with the only method that is required: one lethal cell."""

    def paint(self, canvas):
        top, bottom, left, right = canvas.box
        row, column = 40 - top, 60 - left
        if 0 <= row < bottom - top and 0 <= column < right - left:
            canvas.cells[row, column] = LETHAL_COST


def test_a_layer_needs_only_to_paint():
    use = f"{__name__}:Puddle"
    costmap = made("static", use, parameters=CostmapParameters(), footprint=ROUND)
    assert costmap.grid.cells[40, 60] == LETHAL_COST and costmap.grid.cells[40, 61] == 253
    costmap.update(seen(Pose2D(0.0, 0.0), scan([1.0]), 0.0))
    costmap.clear()
    assert costmap.grid.cells[40, 60] == LETHAL_COST
    assert costmap.explain(*costmap.grid.centre_of(40, 60)) is None  # it names no origin
    beside = made(
        "static", {"use": use, "inflated": False}, parameters=CostmapParameters(), footprint=ROUND
    )
    assert np.count_nonzero(beside.grid.cells) == 1


def test_a_costmap_without_a_list_has_the_default_layers():
    assert [layer.name for layer in usual_layers()] == ["static", "obstacle"]
    assert [layer.only for layer in usual_layers()] == ["both", "both"]


@pytest.mark.parametrize(
    ("listed", "lidars", "expected"),
    [
        (["obstacle"], ("lidar",), {"obstacle": "lidar"}),
        (["obstacle"], ("front", "rear"), {"obstacle_front": "front", "obstacle_rear": "rear"}),
        (["obstacle"], ("lidar", "rear"), {"obstacle": "lidar", "obstacle_rear": "rear"}),
        (
            ["obstacle", {"use": "obstacle", "name": "behind", "source": "rear", "decay": 2.0}],
            ("lidar", "rear"), {"obstacle": "lidar", "behind": "rear"},
        ),
        ([{"use": "obstacle", "source": "rear"}], ("lidar", "rear"), {"obstacle": "rear"}),
        (["obstacle"], (), {"obstacle": "lidar"}),
    ],
)  # fmt: skip
def test_a_listed_obstacle_layer_without_source_reads_every_lidar(listed, lidars, expected):
    layers = for_lidars(read_layers(["static", *listed], CostmapParameters()), lidars)
    assert layers[0].name == "static"
    found = {layer.name: layer.parameters(CostmapParameters()).source for layer in layers[1:]}
    assert found == expected


def test_the_layers_in_place_of_sensors_begin_with_its_name():
    entries = ["static", {"use": "sensors", "name": "near", "only": "local", "decay": 2.0}]
    layers = with_sensors(entries, ["obstacle", "depth"])
    assert layers[1:] == [
        {"use": "obstacle", "name": "near_obstacle", "only": "local", "decay": 2.0},
        {"use": "depth", "name": "near_depth", "only": "local"},
    ]


def test_every_lidar_marks_by_default_and_sonars_where_there_is_no_lidar():
    both = usual_layers(("lidar", "rear"), ("front",))
    assert [layer.name for layer in both] == [
        "static", "obstacle", "obstacle_rear",
    ]  # fmt: skip
    assert both[2].values["source"] == "rear"
    assert [layer.name for layer in usual_layers((), ("front",))] == ["static", "range"]


# Who marked it


@pytest.mark.pain("n4043", "n3661", "n2915")
def test_a_lethal_cell_says_which_layer_and_source_marked_it_and_when():
    static = room()
    static.cells[40, 60] = OCCUPIED  # middle (2.025, 0.025)
    zone = {"use": "keepout", "zones": [{"name": "stairs", "corners": SQUARE}]}
    costmap = made("static", "obstacle", zone, static=static)
    costmap.update(seen(Pose2D(0.025, -0.975), scan([1.0]), 4.25))
    assert costmap.explain(1.025, -0.975) == CellProvenance("obstacle", "lidar", 4.25)
    assert costmap.explain(2.025, 0.025) == CellProvenance("static", "map")
    assert costmap.explain(1.5, 0.5) == CellProvenance("keepout", "stairs")
    assert costmap.explain(0.5, -0.975) is None
    assert costmap.explain(99.0, 0.0) is None
    costmap.update(seen(Pose2D(0.025, -0.975), scan([1.0]), 5.5))
    assert costmap.explain(1.025, -0.975) == CellProvenance("obstacle", "lidar", 5.5)
    above = made("static", "obstacle", {**zone, "inflated": False}, static=static)
    above.update(seen(Pose2D(0.025, -0.975), scan([1.0]), 4.25))
    assert above.explain(1.025, -0.975) == CellProvenance("obstacle", "lidar", 4.25)
    assert above.explain(1.5, 0.5) == CellProvenance("keepout", "stairs")


@given(st.lists(st.tuples(st.floats(0.3, 2.4), st.floats(-2, 2)), min_size=1, max_size=8))
@settings(deadline=None, max_examples=20)
def test_every_lethal_cell_has_an_origin_and_no_other_one(places):
    costmap = made(
        "static", "obstacle", "range", {"use": "keepout", "zones": [SQUARE]},
        parameters=CostmapParameters(denoise=True), footprint=ROUND,
    )  # fmt: skip
    for step, (distance, heading) in enumerate(places):
        costmap.update(
            seen(
                Pose2D(0.1 * step, 0.0, heading), scan([distance] * 5), step, readings=[sonar(1.0)]
            )
        )
    grid = costmap.grid
    for row, column in np.ndindex(grid.cells.shape):
        origin = costmap.explain(*grid.centre_of(row, column))
        assert (origin is not None) == (grid.cells[row, column] == LETHAL_COST)


# Several lidars


def test_each_lidar_marks_and_clears_for_itself():
    rear = {"use": "obstacle", "name": "low", "source": "low_lidar"}
    costmap = made("static", "obstacle", rear)
    pose = Pose2D(0.025, 0.025)
    costmap.update(seen(pose, scan([1.5]), 0.0))
    costmap.update(seen(pose, scan([1.0]), 0.1, source="low_lidar"))
    costmap.update(seen(pose, scan([1.5]), 0.2))  # looks over what the low one sees
    assert costmap.explain(1.025, 0.025) == CellProvenance("low", "low_lidar", pytest.approx(0.1))
    assert costmap.explain(1.525, 0.025).source == "lidar"
    costmap.update(seen(pose, scan([2.0]), 0.3, source="low_lidar"))
    assert at(costmap, 1.025, 0.025) == FREE_COST
    assert at(costmap, 1.525, 0.025) == LETHAL_COST


def test_a_persistent_mark_withstands_beams_for_its_time():
    costmap = made("static", {"use": "obstacle", "persistence": "1 s"})
    pose = Pose2D(0.025, 0.025)
    costmap.update(seen(pose, scan([1.0]), 0.0))
    costmap.update(seen(pose, scan([2.0]), 0.9))
    assert at(costmap, 1.025, 0.025) == LETHAL_COST
    costmap.update(seen(pose, scan([2.0]), 1.0))
    assert at(costmap, 1.025, 0.025) == FREE_COST


# Clearing


def marked_in_three_places(**more):
    costmap = made("static", "obstacle", "range", **more)
    pose = Pose2D(0.025, 0.025)
    costmap.update(seen(pose, scan([1.0, 1.5, 2.0], angle_increment=pi / 2), 0.0))
    return costmap


def test_clearing_around_the_robot_leaves_what_is_farther_away():
    costmap = marked_in_three_places()
    costmap.clear_around(Pose2D(0.025, 0.025), 1.2)
    assert at(costmap, 1.025, 0.025) == FREE_COST
    assert at(costmap, 0.025, 1.525) == LETHAL_COST
    costmap.clear_around(Pose2D(0.025, 0.025), 1.51)
    assert not sensed(costmap).any()


def test_clearing_one_layer():
    costmap = marked_in_three_places()
    costmap.clear(layer="range")
    assert np.count_nonzero(sensed(costmap)) == 2  # the third lies beyond the room's edge
    assert at(costmap, 0.025, 1.525) == LETHAL_COST
    costmap.clear(layer="obstacle")
    assert not sensed(costmap).any()
    with pytest.raises(ParameterError, match="did you mean 'obstacle'"):
        try:
            costmap.clear(layer="obstacles")
        except ParameterError as error:
            raise ParameterError(error.name, f"{error.sentence} {error.hint}") from None


# Sonars


def test_a_sonar_reading_gives_the_probabilities_of_nav2s_sensor_model():
    nav2 = {"use": "range", "rim": 0.0, "fading": "1.2 m"}
    costmap = made("static", nav2, static=room(100, 120, origin=(-1.0, -2.025)))
    costmap.update(seen(Pose2D(0.0, 0.0), None, 0.0, readings=[sonar(1.0)]))
    # on the axis the first hit gives 0.5 + trust/2 · (1 - J²), J = (1 - 0.975) / 0.05
    trust = 1.0 - 0.5 * (1.0 + tanh(2.0 * (0.975 - 1.2)))
    first = 0.5 + trust * (0.5 - 0.5 * 0.5**2)
    assert first == pytest.approx(0.7666, abs=1e-4)  # below 0.8: not yet believed
    assert at(costmap, 0.975, 0.0) == FREE_COST
    costmap.update(seen(Pose2D(0.0, 0.0), None, 0.1, readings=[sonar(1.0)]))
    # twice: p² / (p² + (1 - p)²) = 0.915
    assert at(costmap, 0.975, 0.0) == LETHAL_COST
    assert costmap.explain(0.975, 0.0) == CellProvenance("range", "front_sonar", pytest.approx(0.1))
    assert at(costmap, 0.975, 0.5) == FREE_COST  # 27 degrees off, the cone ends at 15


def test_a_sonar_frees_its_cone_when_it_hears_nothing_and_forgets_in_time():
    costmap = made({"use": "range", "decay": "5 s"}, window=6.0, parameters=ONLY_CELLS)
    pose = Pose2D(0.025, 0.025)
    for step in range(3):
        costmap.update(seen(pose, None, 0.1 * step, readings=[sonar(inf)]))
    assert at(costmap, 0.525, 0.025) == FREE_COST
    assert at(costmap, 0.525, 0.525) == UNKNOWN_COST
    for step in range(4):
        costmap.update(seen(pose, None, 0.3 + 0.1 * step, readings=[sonar(0.5)]))
    assert at(costmap, 0.525, 0.025) == LETHAL_COST
    costmap.update(seen(pose, None, 6.1))
    assert at(costmap, 0.525, 0.025) == UNKNOWN_COST


def lethal(costmap):
    """The middles of the lethal cells, metres."""
    cells = np.argwhere(costmap.grid.cells == LETHAL_COST)
    return {tuple(round(value, 6) for value in costmap.grid.centre_of(*cell)) for cell in cells}


@pytest.mark.parametrize(("x", "y"), [(0.275, 0.025), (-0.225, 0.425), (0.125, -0.325)])
def test_what_a_sonar_has_heard_keeps_its_place_and_age_when_the_window_rolls(x, y):
    costmap = made({"use": "range", "decay": "5 s"}, window=6.0, parameters=ONLY_CELLS)
    for step in range(4):
        costmap.update(seen(Pose2D(0.025, 0.025), None, 0.1 * step, readings=[sonar(1.0)]))
    heard, origin = lethal(costmap), costmap.grid.origin
    assert (1.025, 0.025) in heard
    costmap.update(seen(Pose2D(x, y), None, 0.4))
    assert costmap.grid.origin != origin
    assert lethal(costmap) == heard
    marked = CellProvenance("range", "front_sonar", pytest.approx(0.3))
    assert costmap.explain(1.025, 0.025) == marked
    costmap.update(seen(Pose2D(x, y), None, 6.1))  # 5 s after the last of the readings
    assert lethal(costmap) == set()


# Noise


def test_denoise_drops_groups_below_its_size_but_nothing_of_the_map():
    static = room()
    static.cells[40, 60] = OCCUPIED  # a single cell of the map, middle (2.025, 0.025)
    denoise = {"use": "denoise", "smallest_group": 3}
    costmap = made("static", "obstacle", denoise, static=static)
    pose = Pose2D(0.025, 0.025)
    pair = [1.0, 1.0]  # 1 m away and 0.06 rad apart: two cells above each other
    costmap.update(seen(pose, scan(pair, angle_min=0.5, angle_increment=0.06), 0.0))
    assert np.count_nonzero(sensed(costmap)) == 2
    assert np.count_nonzero(costmap.grid.cells == LETHAL_COST) == 1
    costmap.update(seen(pose, scan([1.0] * 3, angle_min=0.5, angle_increment=0.06), 0.1))
    assert np.count_nonzero(costmap.grid.cells == LETHAL_COST) == 4
    beside = scan([sqrt(1.95**2 + 0.0)], angle_min=0.0)
    costmap.clear()
    costmap.update(seen(pose, beside, 0.2))  # one cell that touches the map's
    assert np.count_nonzero(costmap.grid.cells == LETHAL_COST) == 2


# Rules of a place


def test_a_keepout_zone_keeps_the_whole_footprint_out():
    costmap = made(
        "static", "obstacle", {"use": "keepout", "zones": [SQUARE]},
        parameters=CostmapParameters(), footprint=ROUND,
    )  # fmt: skip
    cells = costmap.grid.cells
    assert np.count_nonzero(cells == LETHAL_COST) == 22 * 22  # 1 m² of 5 cm cells, grown by 7 cm
    assert at(costmap, 0.775, 0.5) == 253  # 0.175 m + half a cell from 0.95 m, within 0.22 m
    costmap.clear()
    assert at(costmap, 1.5, 0.5) == LETHAL_COST


def test_a_keepout_zone_stays_where_it_is_under_a_rolling_window():
    layers = ("obstacle", {"use": "keepout", "zones": [SQUARE]})
    costmap = made(*layers, window=3.0)
    for x, y in ((0.0, 0.0), (0.33, -0.2), (1.4, 0.4), (2.6, 0.9), (1.5, 0.5)):
        costmap.update(seen(Pose2D(x, y), None, 0.0))
        for row, column in np.argwhere(costmap.grid.cells == LETHAL_COST):
            place = costmap.grid.centre_of(row, column)
            assert 0.93 < place[0] < 2.07 and -0.07 < place[1] < 1.07  # 7 cm larger
    # All 22 x 22 cells, except the way out of the robot, which stands in its middle: 13 x 7 cells.
    assert 22 * 22 - 110 < np.count_nonzero(costmap.grid.cells == LETHAL_COST) < 22 * 22 - 60


def test_a_mask_picture_is_a_zone(tmp_path):
    mask = room(20, 20, origin=(0.0, 0.0))
    mask.cells[5:10, 5:15] = OCCUPIED  # x 0.25..0.75, y 0.25..0.5
    write_ros_map(mask, tmp_path / "keepout.yaml")
    (choice,) = read_layers([{"use": "keepout", "mask": "keepout.yaml"}], ONLY_CELLS)
    costmap = Costmap(ONLY_CELLS, TINY, room(), layers=[choice.located(tmp_path)])
    assert (
        np.count_nonzero(costmap.grid.cells == LETHAL_COST) == 7 * 14 + 2 * 10
    )  # grown by two cells
    assert costmap.explain(0.5, 0.3) == CellProvenance("keepout", "mask")
    with pytest.raises(InputError, match=r"mask file keepout.yaml does not exist"):
        choice.located(tmp_path / "elsewhere")


def test_lanes_cost_what_they_did_and_every_other_place_more():
    static = room()
    static.cells[40, 40] = OCCUPIED
    lanes = {"use": "preferred_lanes", "zones": [SQUARE], "cost_outside": 50}
    costmap = made(
        "static", lanes, parameters=CostmapParameters(), footprint=ROUND,
        static=static,
    )  # fmt: skip
    plain = made("static", parameters=CostmapParameters(), footprint=ROUND, static=static)
    assert at(costmap, 1.7, 0.7) == 0 and at(costmap, 2.5, 0.5) == 50
    assert at(costmap, 1.025, 0.025) == LETHAL_COST
    inside = (slice(40, 60), slice(40, 60))
    assert np.array_equal(costmap.grid.cells[inside], plain.grid.cells[inside])
    outside = np.maximum(plain.grid.cells, 50)
    outside[inside] = plain.grid.cells[inside]
    assert np.array_equal(costmap.grid.cells, outside)


# People


def test_the_space_before_a_walker_costs_and_the_space_behind_does_not():
    costmap = made("static", "obstacle", "social")
    costmap.update(seen(Pose2D(0.0, 0.0), None, 0.0, tracks=[walker(1.0, 0.0, 1.0)]))
    # defaults: cost 200, horizon 2 s, fade 0.6, spread 0.3 m; cells' middles at ….025
    assert at(costmap, 1.025, 0.025) == int(200 * (1 - 0.6 * 0.025 / 2))
    assert at(costmap, 2.025, 0.025) == int(200 * (1 - 0.6 * 1.025 / 2)) == 138
    aside = exp(-0.5 * ((0.525 - 0.25) / 0.3) ** 2)
    assert at(costmap, 2.025, 0.525) == int(200 * (1 - 0.6 * 1.025 / 2) * aside) == 90
    behind = np.hypot(0.675, 0.025) - 0.25
    assert at(costmap, 0.325, 0.025) == int(200 * exp(-0.5 * (behind / 0.3) ** 2))
    assert at(costmap, -0.225, 0.025) == 0
    assert not sensed(costmap).any()


@pytest.mark.parametrize("ahead", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_the_whole_way_before_a_walker_costs_wherever_it_leads(ahead):
    """200 (1 - 0.6 t / 2) t seconds ahead, up to the horizon of 2 s."""
    costmap = made("static", "obstacle", "social")
    costmap.update(seen(Pose2D(0.0, 0.0), None, 0.0, tracks=[walker(1.0, 0.0, *ahead)]))
    for time in (0.925, 1.425, 1.925):
        there = at(costmap, 1.001 + time * ahead[0], 0.001 + time * ahead[1])
        assert there == int(200 * (1 - 0.6 * time / 2))


def test_the_cost_follows_the_walker_and_goes_with_it():
    costmap = made("static", "obstacle", "social")
    costmap.update(seen(Pose2D(0.0, 0.0), None, 0.0, tracks=[walker(1.0, 0.0, 1.0)]))
    costmap.update(seen(Pose2D(0.0, 0.0), None, 1.0, tracks=[walker(1.0, 0.0, 1.0, stamp=0.0)]))
    assert at(costmap, 2.025, 0.025) == int(200 * (1 - 0.6 * 0.025 / 2))
    costmap.update(seen(Pose2D(0.0, 0.0), None, 1.1))  # no news
    assert at(costmap, 2.025, 0.025) > 0
    costmap.update(seen(Pose2D(0.0, 0.0), None, 1.2, tracks=[]))
    assert not costmap.grid.cells.any()
    version = costmap.version
    costmap.update(seen(Pose2D(0.0, 0.0), None, 1.3, tracks=[]))
    assert costmap.version == version


def test_people_never_make_lethal_cells_cheaper_or_unknown_ones_known():
    static = room()
    static.cells[:, 80:] = -1
    static.cells[40, 45] = OCCUPIED
    costmap = made("static", "social", static=static)
    before = costmap.grid.cells.copy()
    costmap.update(seen(Pose2D(-0.5, -1.0), None, 0.0, tracks=[walker(1.0, 0.0, 1.5)]))
    after = costmap.grid.cells
    assert np.array_equal(after[before >= 253], before[before >= 253])
    assert (after >= before).all() and after.max() == UNKNOWN_COST


# Only what changed


@given(
    st.lists(
        st.tuples(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5), st.floats(-3, 3)),
        min_size=1, max_size=6,
    ),
    st.booleans(), st.booleans(), st.integers(0, 99),
)  # fmt: skip
@settings(deadline=None, max_examples=50)
def test_patching_gives_the_same_cells_as_painting_all(poses, rolls, denoise, seed):
    random = np.random.default_rng(seed)
    static = room(120, 120, origin=(-3.0, -3.0))
    static.cells[random.integers(0, 120, 40), random.integers(0, 120, 40)] = OCCUPIED
    parameters = replace(CostmapParameters(), decay=1.0, denoise=denoise)
    lanes = {"use": "preferred_lanes", "zones": [[[-1, -1], [2, -1], [2, 1]]]}
    costmap = made(
        "static", "obstacle", "range", {"use": "keepout", "zones": [SQUARE]},
        lanes, "social", parameters=parameters, footprint=ROUND, static=static,
        window=4.0 if rolls else None,
    )  # fmt: skip
    for step, (x, y, heading) in enumerate(poses):
        beams = scan(random.uniform(0.3, 3.5, 60), angle_increment=0.1)
        tracks = [walker(x + 1.0, y, 1.0, -0.5, stamp=0.4 * step)]
        costmap.update(
            seen(Pose2D(x, y, heading), beams, 0.4 * step, readings=[sonar(1.0)], tracks=tracks)
        )
    patched = costmap.grid.cells
    costmap.configure(costmap.parameters)  # paints and inflates everything
    assert np.array_equal(costmap.grid.cells, patched)


@given(st.integers(-30, 30), st.integers(-30, 30), st.integers(0, 5), st.integers(0, 5))
@settings(deadline=None, max_examples=60)
def test_edges_cover_what_came_into_sight(rows, columns, lead, trail):
    known = np.zeros((20, 25), dtype=bool)
    known[max(0, -rows) : 20 - max(0, rows), max(0, -columns) : 25 - max(0, columns)] = True
    for top, bottom, left, right in edges((20, 25), (rows, columns), lead=lead, trail=trail):
        known[top:bottom, left:right] = True
    assert known.all()


# Lists of layers in missions


def test_a_layer_inherits_missing_parameters_from_the_costmap():
    parameters = CostmapParameters(obstacle_range=1.2)
    near, far = {"use": "obstacle"}, {"use": "obstacle", "obstacle_range": "2 m", "name": "far"}
    costmap = made("static", near, parameters=parameters)
    other = made("static", far, parameters=parameters)
    for item in (costmap, other):
        item.update(seen(Pose2D(0.025, 0.025), scan([1.5]), 0.0))
    assert not sensed(costmap).any() and sensed(other).any()
    costmap.configure(replace(parameters, obstacle_range=1.8))
    costmap.update(seen(Pose2D(0.025, 0.025), scan([1.5]), 0.1))
    assert sensed(costmap).any()


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"use": "obstacle", "rang": 2}, "there is no parameter 'rang' here"),
        ({"use": "keepout", "zones": [[[0, 0], [1, 1]]]}, "at least three"),
        ({"use": "keepout", "zones": [[[0, 0], [1, 1], [2]]]}, "a corner is"),
        ({"use": "social", "only": "lokal"}, "'lokal' is not one of"),
        ({"use": "obstacle", "obstacle_range": 9}, "clearing_range"),
        (7, "expected a layer name"),
        ("static", "the name 'static' is used twice"),
    ],
)
def test_an_invalid_entry_is_reported_with_its_number(entry, words):
    with pytest.raises(ParameterError, match="layer 2") as raised:
        read_layers(["static", entry], CostmapParameters())
    assert words in str(raised.value) and raised.value.name == "layers"


def test_an_unknown_layer_is_an_error_with_a_suggestion():
    with pytest.raises(ParameterError, match=r"layer 1: .* did you mean 'obstacle'"):
        read_layers(["obstacles"], CostmapParameters())
    with pytest.raises(ParameterError, match="expected a list of layers"):
        read_layers("static", CostmapParameters())
