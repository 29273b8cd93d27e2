"""Hotels of equal rooms, a start in one of them, and drives to views: never a wrong room."""

from math import atan2

import numpy as np
import pytest

from stack.localisation.distance_field import surface_field
from stack.localisation.mcl.localiser import Localiser
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.view_planner import CELL, ViewPlanner
from stack.types import Pose2D
from tests.stack.localisation.drawn_office import Drifting, Place, drawn, mapped
from tests.stack.navigation.toy_world import robot

DEPTH, CORRIDOR = 4.2, 1.8


def hotel(seed: int) -> tuple[Place, Pose2D]:
    """Two to four equal rooms on a corridor, unmapped boxes, and a start in one of the rooms."""
    generator = np.random.default_rng(seed)
    rooms, width = int(generator.integers(2, 5)), float(generator.uniform(3.4, 4.4))
    length, depth = rooms * width + 0.1, CORRIDOR + DEPTH
    walls = [
        (0.0, 0.0, length, 0.1), (0.0, depth - 0.1, length, depth),
        (0.0, 0.0, 0.1, depth), (length - 0.1, 0.0, length, depth),
    ]  # fmt: skip
    door, bed = generator.uniform(0.3, width - 1.4), generator.uniform(0.2, width - 2.2)
    for x in np.arange(rooms) * width:
        walls += [
            (x + width - 0.05, CORRIDOR, x + width + 0.05, depth),
            (x, CORRIDOR, x + door, CORRIDOR + 0.1),
            (x + door + 1.0, CORRIDOR, x + width, CORRIDOR + 0.1),
            (x + bed, depth - 1.0, x + bed + 1.8, depth),
            (x + 0.1, CORRIDOR + 1.6, x + 0.5, CORRIDOR + 2.3),
        ]
    x = generator.uniform(0.5, length - 1.2)
    known = [*walls, (x, 0.1, x + 0.7, 0.45)]  # the printer
    box = generator.uniform(0.5, length - 1.0)
    unmapped = [(box, 0.1, box + 0.4, 0.35)]
    place = Place(drawn([*known, *unmapped], length, depth), mapped(drawn(known, length, depth)))
    start = place.free_pose(generator)
    while start.y < CORRIDOR + 0.4:
        start = place.free_pose(generator)
    return place, start


def way(reach: np.ndarray, motion: Pose2D) -> list[Pose2D]:
    """Cells from the robot to a motion down the ways of `ViewPlanner.reach`, base frame."""
    half = reach.shape[0] // 2
    at = (half + round(motion.y / CELL), half + round(motion.x / CELL))
    cells = [at]
    while reach[at] > 0:
        around = [(at[0] + r, at[1] + c) for r in (-1, 0, 1) for c in (-1, 0, 1)]
        at = min(around, key=lambda cell: reach[cell])
        cells.append(at)
    return [Pose2D((c - half) * CELL, (r - half) * CELL) for r, c in reversed(cells)]


def drive(localiser, place, truth, motion, odometry, generator) -> Pose2D:
    """Drive by a motion with a scan every 10 cm until one pose is left; return the truth."""
    planner = ViewPlanner(surface_field(place.grid), 0.25)
    start = truth
    for step in way(planner.reach([truth]), motion)[1:]:
        to = start.compose(step)
        new = Pose2D(to.x, to.y, atan2(to.y - truth.y, to.x - truth.x))
        moved, truth = new.relative_to(truth), new
        localiser.process(odometry.move(moved, 0.3), place.scan(truth, 0.0, generator))
        if not localiser.estimate.ambiguous:
            break
    return truth


@pytest.mark.parametrize("seed", range(6))
def test_the_room_is_found_and_never_a_wrong_one(seed):
    place, truth = hotel(seed)
    generator = np.random.default_rng(seed + 100)
    odometry = Drifting(generator)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, seed)
    localiser.process(odometry.pose)
    scan = place.scan(truth, 0.0, generator)
    localiser.process(odometry.pose, scan)
    for _ in range(6):
        if not localiser.estimate.ambiguous:
            break
        estimate = localiser.estimate
        places = [estimate.pose, *(rival.pose for rival in estimate.rivals)]
        assert min(pose.distance_to(truth) for pose in places) < 0.2
        view = localiser.best_view(scan)
        assert view is not None
        truth = drive(localiser, place, truth, view.motion, odometry, generator)
        scan = place.scan(truth, 0.0, generator)
    assert not localiser.estimate.ambiguous
    assert localiser.estimate.pose.distance_to(truth) < 0.2


def test_several_scans_from_one_pose_are_one_view():
    """The errors of the map are the same in each of them."""
    place, truth = hotel(2)
    generator = np.random.default_rng(102)
    localiser = Localiser(LocaliserParameters(), robot(), place.grid, 2)
    scan = place.scan(truth, 0.0, generator)
    earlier = [(Pose2D(0.0, 0.0), place.scan(truth, 0.0, generator)) for _ in range(2)]
    once, thrice = (localiser.map.search.everywhere(scan, views)[0] for views in ((), earlier))
    assert thrice.evidence == pytest.approx(once.evidence, abs=0.2)
    assert thrice.cost == once.cost
