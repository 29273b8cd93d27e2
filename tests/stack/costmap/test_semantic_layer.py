"""Semantic layer: costs by what things are, their memory and decay."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
from stack.costmap.layer import LayerUpdate
from stack.costmap.parameters import CostmapParameters
from stack.errors import ParameterError
from stack.types import (
    FREE,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN,
    UNKNOWN_COST,
    Detection,
    Footprint,
    OccupancyGrid,
    Pose2D,
    TrackedObject,
)

ONLY_CELLS = CostmapParameters(inflation_radius=0.0)
THINGS = [
    {"label": "person", "radius": "1 m", "cost": 200, "memory": "5 s"},
    {"label": "chair", "radius": "0.5 m", "cost": 100, "memory": "60 s"},
]


def room(value=FREE):
    return OccupancyGrid(np.full((80, 100), value, dtype=np.int8), 0.05, (-1.0, -2.0))


def made(*, static=None, window=None, **parameters):
    layers = read_layers(["static", {"use": "semantic", **parameters}], ONLY_CELLS)
    static = room() if static is None and window is None else static
    return Costmap(ONLY_CELLS, Footprint.circle(0.02), static, window=window, layers=layers)


def seen(label, x, y=0.0, stamp=0.0):
    return Detection(label, stamp, (x, y), 0.05, 0.5, 0.9, (0, 0, 9, 9))


def person(x, y=0.0, *, speed=(0.0, 0.0), number=1, stamp=0.0, label="person"):
    return TrackedObject(number, stamp, (x, y), speed, 0.25, np.eye(4), label)


def show(costmap, *detections, time=0.0, tracks=None):
    costmap.update(LayerUpdate(Pose2D(0.0, 0.0), time, detections=detections, tracks=tracks))


def at(costmap, x, y):
    return int(costmap.grid.cells[costmap.grid.cell_at(x, y)])


def test_the_cost_falls_linearly_to_the_radius_of_the_label():
    costmap = made(things=THINGS)
    show(costmap, seen("chair", 1.025, 0.025), seen("person", 1.025, 1.525))
    assert at(costmap, 1.025, 0.025) == 100
    assert at(costmap, 1.275, 0.025) == 50  # half way
    assert at(costmap, 1.475, 0.025) == 10
    assert at(costmap, 1.575, 0.025) == 0
    assert at(costmap, 1.025, 1.525) == 200
    assert at(costmap, 1.525, 1.525) == 100
    # Between them, 0.75 m from either: only the person reaches so far.
    assert at(costmap, 1.025, 0.775) == pytest.approx(200 * 0.25, abs=1)


def test_the_defaults_are_wide_and_costly_for_people():
    costmap = made()
    show(costmap, seen("person", 0.025, 0.025), seen("chair", 2.525, 0.025))
    assert at(costmap, 0.025, 0.025) == 220 and at(costmap, 0.625, 0.025) == 110
    assert at(costmap, 2.525, 0.025) == 120 and at(costmap, 2.825, 0.025) == 60
    show(costmap, seen("door", 2.525, 1.225))
    assert at(costmap, 2.525, 1.225) == 80


def test_labels_that_are_not_listed_cost_nothing():
    costmap = made(things=THINGS)
    show(costmap, seen("dog", 1.0), tracks=(person(2.0, label=""),))
    assert not costmap.grid.cells.any()


def test_it_is_never_lethal_and_leaves_walls_and_unknown_cells():
    static = room()
    static.cells[40, 40:45] = OCCUPIED
    static.cells[42, 40:45] = UNKNOWN
    costmap = made(static=static, things=[{"label": "chair", "cost": 252, "radius": 1.0}])
    show(costmap, seen("chair", 1.025, 0.025))
    assert (costmap.grid.cells[40, 40:45] == LETHAL_COST).all()
    assert (costmap.grid.cells[42, 40:45] == UNKNOWN_COST).all()
    assert 200 < costmap.grid.cells[41, 40:45].max() <= 252
    assert costmap.explain(1.025, 0.075) is None


def test_a_thing_that_is_not_seen_fades_over_its_memory_in_ten_steps():
    costmap = made(things=THINGS)
    show(costmap, seen("chair", 1.025, 0.025))
    levels = []
    for second in range(61):
        show(costmap, time=float(second))
        levels.append(at(costmap, 1.025, 0.025))
    # 60 s in steps of a tenth, rounded up: 100 until 6 s, 50 at 30 s, 0 from 60 s on.
    assert levels[0] == levels[5] == 100
    assert levels[30] == 50 and levels[59] == 10 and levels[60] == 0
    assert sorted(levels, reverse=True) == levels and len(set(levels)) == 11


def test_a_new_sighting_restores_the_cost_and_moves_the_thing():
    costmap = made(things=THINGS)
    show(costmap, seen("chair", 1.0, 0.025))
    show(costmap, seen("chair", 1.25, 0.025, stamp=30.0), time=30.0)
    # One thing, 40 % of the way to the new place: at x = 1.1.
    assert at(costmap, 1.075, 0.025) == at(costmap, 1.125, 0.025) == 95
    assert costmap.grid.cells.max() == 95
    show(costmap, seen("chair", 2.025, 0.025, stamp=31.0), time=31.0)  # another chair
    assert at(costmap, 2.025, 0.025) == 100 and at(costmap, 1.075, 0.025) == 95


def test_a_label_has_things_of_its_own_at_the_same_place():
    costmap = made(things=THINGS)
    show(costmap, seen("chair", 1.025, 0.025), seen("person", 1.025, 0.025))
    show(costmap, time=6.0)  # the person is forgotten
    assert at(costmap, 1.025, 0.025) == 90


def test_the_cost_follows_a_person_who_is_tracked_and_stays_where_the_track_ends():
    costmap = made(things=THINGS)
    show(costmap, tracks=(person(0.025, 0.025),))
    show(costmap, tracks=(person(1.025, 0.025, stamp=1.0),), time=1.0)
    assert at(costmap, 1.025, 0.025) == 200 and at(costmap, -0.025, 0.025) == 0
    show(costmap, tracks=(), time=3.5)  # half of the memory later
    assert at(costmap, 1.025, 0.025) == 100
    show(costmap, tracks=(), time=6.0)
    assert not costmap.grid.cells.any()


def test_a_person_who_is_tracked_and_detected_counts_once():
    costmap = made(things=THINGS)
    show(costmap, seen("person", 1.2, 0.025))
    show(costmap, tracks=(person(1.025, 0.025, stamp=0.1),), time=0.1)
    show(costmap, seen("person", 1.25, 0.025, stamp=0.1), time=0.2)
    assert at(costmap, 1.025, 0.025) == 200
    assert at(costmap, 1.525, 0.025) == pytest.approx(100, abs=1)  # not around 1.2


def test_a_new_track_of_the_same_person_replaces_the_old_one():
    costmap = made(things=THINGS)
    show(costmap, tracks=(person(1.025, 0.025, number=1),))
    show(costmap, tracks=(person(1.325, 0.025, number=2, stamp=0.5),), time=0.5)
    assert at(costmap, 1.325, 0.025) == 200
    assert at(costmap, 0.825, 0.025) == pytest.approx(100, abs=1)
    both = (person(1.025, 0.025, number=2), person(1.325, 0.025, number=3))
    show(costmap, tracks=both, time=0.0)
    assert at(costmap, 1.025, 0.025) == at(costmap, 1.325, 0.025) == 200


def test_things_are_cleared_everywhere_or_around():
    costmap = made(things=THINGS)
    show(costmap, seen("chair", 0.0), seen("chair", 2.5))
    costmap.clear_around(Pose2D(0.0, 0.0), 0.5)
    assert at(costmap, 0.0, 0.0) == 0 and at(costmap, 2.525, 0.025) > 90
    costmap.clear(layer="semantic")
    assert not costmap.grid.cells.any()


def test_things_keep_their_places_in_a_window_that_rolls():
    costmap = made(window=3.0, things=THINGS, static=room())
    show(costmap, seen("chair", 1.025, 0.025))
    for x in (0.5, 1.0, 1.5):
        costmap.update(LayerUpdate(Pose2D(x, 0.0), x))
        assert at(costmap, 1.025, 0.025) == 100
    costmap.update(LayerUpdate(Pose2D(3.0, 0.0), 3.0))
    costmap.update(LayerUpdate(Pose2D(1.0, 0.0), 4.0))
    assert at(costmap, 1.025, 0.025) == 100


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["chair", "person"]), st.floats(-1.5, 4.5), st.floats(-2.5, 2.5),
            st.floats(0.0, 20.0),
        ),
        min_size=1, max_size=12,
    )
)  # fmt: skip
@settings(deadline=None, max_examples=25)
def test_repainting_what_changed_gives_the_cells_of_a_complete_repaint(sightings):
    costmap, time = made(things=THINGS), 0.0
    for label, x, y, later in sightings:
        time += later
        show(costmap, seen(label, x, y, stamp=time), time=time)
    partial = costmap.grid.cells.copy()
    costmap.configure(replace(costmap.parameters))
    np.testing.assert_array_equal(costmap.grid.cells, partial)


@pytest.mark.parametrize(
    ("things", "sentence"),
    [
        (["chair"], "thing 1: expected {label: text"),
        ([{"radius": 1.0}], "thing 1: expected {label: text"),
        ([{"label": "chair", "cost": 300}], "thing 1: cost: 300 must be at most 252"),
        ([{"label": "chair", "raduis": 1.0}], "thing 1: raduis: there is no parameter"),
        ([{"label": "chair"}, {"label": "chair"}], "'chair' is listed twice"),
    ],
)
def test_wrong_things_are_errors(things, sentence):
    with pytest.raises(ParameterError, match=sentence):
        made(things=things)
