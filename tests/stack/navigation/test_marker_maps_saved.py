"""Which markers are saved with a map: exact ones stay, those with a deviation are replaced."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from stack.errors import InputError, NavigationError
from stack.mapping.marker_maps import MARKERS_YAML, read_marker_map
from stack.navigation.capabilities.map import StackMap
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.survey import MarkerSurvey
from stack.types import FREE, Marker, OccupancyGrid

EXACT = Marker(1, 0.2, (1.0, 2.0, 0.4), 0.0)
EARLIER = Marker(2, 0.2, (3.0, 2.0, 0.4), 0.0, position_deviation=0.05, heading_deviation=0.1)
MAPPED = [
    Marker(n, 0.2, (9.0, n, 0.4), 0.5, position_deviation=0.03, heading_deviation=0.02)
    for n in (1, 2, 3)
]


class Store:
    def __init__(self):
        self.files = {}

    def save(self, name, files):
        self.files = files
        return name

    def find(self, name):
        return Path(name)


def service(mapped, store):
    """The service of a mission that surveys, with an estimator that has mapped markers."""
    grid = OccupancyGrid(np.full((4, 4), FREE, np.int8), 0.05, (0.0, 0.0))
    estimator = SimpleNamespace(
        grid=grid,
        unmapped="",
        map_files=dict,
        mapped_markers=mapped,
        corrected_pose=lambda *_: None,
    )
    robot = read_robot(find_robot("scout", Path()))
    survey = MarkerSurvey(MarkerParameters(survey=True))
    return StackMap(
        robot, estimator, None, None, store, lambda *_, **__: None, survey, (EXACT, EARLIER)
    )


def test_a_marker_without_deviation_is_exact_and_another_one_is_replaced(tmp_path):
    """The deviations gain what all pictures share: 1 cm beside 3 cm."""
    store = Store()
    service(lambda: tuple(MAPPED), store).save("map")
    file = tmp_path / MARKERS_YAML
    file.write_bytes(store.files[MARKERS_YAML])
    saved = {one.number: one for one in read_marker_map(file)}
    assert saved[1] == EXACT
    assert [saved[n].position[:2] for n in (2, 3)] == [(9.0, 2.0), (9.0, 3.0)]
    assert saved[2].position_deviation == pytest.approx(0.0316, abs=1e-4)
    assert len(saved) == 3


def test_markers_that_cannot_be_computed_fail_the_saving():
    def failing():
        raise InputError("SLAM needs gtsam")

    with pytest.raises(NavigationError, match=r"cannot be saved.*needs gtsam"):
        service(failing, Store()).save("map")
