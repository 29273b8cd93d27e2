"""A loop of a large building is found after metres of drift."""

import numpy as np
import pytest

from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import MapperParameters
from stack.mapping.slam.refinement import refine
from stack.types import FloatArray, Pose2D
from tests.stack.mapping.slam.drives import line
from tests.stack.mapping.slam.rooms import box, scan_at

WIDTH, DEPTH, CORRIDOR = 90.0, 40.0, 2.4


def building(seed: int) -> FloatArray:
    """A corridor around a block: niches of chance in the first 45 m, smooth walls elsewhere."""
    rng = np.random.default_rng(seed)
    inner = (CORRIDOR, CORRIDOR, WIDTH - 2 * CORRIDOR, DEPTH - 2 * CORRIDOR)
    walls = [*box(0.0, 0.0, WIDTH, DEPTH), *box(*inner)]
    for x in np.cumsum(rng.uniform(3.0, 7.0, 8)):
        walls += box(float(x), 0.0, float(rng.uniform(0.3, 1.5)), 0.3)
    return np.array(walls)


def drive(slip: float, seed: int) -> tuple[Mapper, list[Pose2D]]:
    """Map a round and 40 m; on the far side odometry is too long by a share."""
    walls, low = building(seed), 0.5 * CORRIDOR
    right, top = WIDTH - low, DEPTH - low
    truth = line((2.0, low), (right, low), (right, top), (low, top), (low, low), (42.0, low),
                 step=0.3)  # fmt: skip
    mapper, odometry = Mapper(MapperParameters(), keep_trajectory=True), truth[0]
    mapper.start(truth[0])
    for k, pose in enumerate(truth):
        if k:
            step = pose.relative_to(truth[k - 1])
            scale = 1.0 + slip * (pose.y == top)
            odometry = odometry.compose(Pose2D(scale * step.x, step.y, step.heading))
        mapper.add(0.1 * k, odometry, scan_at(walls, pose, 0.1 * k, 0.01, k))
    refine(mapper)
    return mapper, truth


@pytest.mark.slow
@pytest.mark.parametrize(("slip", "seed"), [(0.15, 1), (-0.15, 2)])
def test_a_loop_of_250_metres_is_closed_after_ten_metres_of_drift(slip, seed):
    mapper, truth = drive(slip, seed)
    found = [pose for _, pose in mapper.trajectory()]
    # On the far side, 70 m of smooth walls say nothing of the 10 m that odometry errs there.
    for k in range(len(truth) - 80, len(truth), 10):
        first = min(range(150), key=lambda n: truth[n].distance_to(truth[k]))
        moved = found[k].relative_to(found[first])
        assert moved.distance_to(truth[k].relative_to(truth[first])) < 0.1
