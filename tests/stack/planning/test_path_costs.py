"""Costs of paths: smoothing never adds any, and NavFn's reference paths are what they should be."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.planning.geodesic import kernels
from stack.planning.kinematic.search import CollisionChecker, PoseDrive
from stack.planning.kinematic.shaping import Shaping, evenly
from stack.planning.search import StepCosts
from stack.planning.smoothers.choice import SMOOTHERS, shape, smooth
from stack.planning.smoothing import POSE_SPACING, PathCosts, resampled
from stack.types import INSCRIBED_COST, CostGrid, Footprint, Pose2D
from tests.benchmarks.navfn import navfn_path, path_cost
from tests.benchmarks.planners import measured, queries_for
from tests.benchmarks.planning import ROBOT

TABLES = StepCosts.of(3.0, True)
TRAVERSE = TABLES.traverse
SIDE = 40
BENDS = [(5.5, 20.5), (60.5, 20.5)]
"""Corners of the path with two bends, in cells."""


def floor(cells=None):
    return CostGrid(
        np.zeros((SIDE, SIDE), np.uint8) if cells is None else cells, POSE_SPACING, (0, 0)
    )


corners = st.lists(
    st.tuples(st.integers(1, SIDE - 2), st.integers(1, SIDE - 2)), min_size=2, max_size=5,
    unique=True,
)  # fmt: skip


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(SMOOTHERS[:3]), st.integers(0, 2**32 - 1), corners)
def test_a_smoothed_path_never_costs_more_than_it_did(smoother, seed, cells_of_path):
    """Blocks of random cost, and a path over them from corner to corner."""
    random = np.random.default_rng(seed)
    blocks = random.integers(0, INSCRIBED_COST, (SIDE // 5, SIDE // 5)).astype(np.uint8)
    costs = floor(np.kron(blocks, np.ones((5, 5), np.uint8)))
    raw = (np.array(cells_of_path, float) + 0.5) * POSE_SPACING
    before, after = (
        kernels.path_cost(costs.cells, TRAVERSE, path.points[:, :2] / POSE_SPACING)
        for path in (
            smooth(name, PathCosts(costs, TRAVERSE), raw, 0.0) for name in ("none", smoother)
        )
    )
    assert after <= before * (1.0 + 1e-9) + 1e-5


def path_with_two_bends():
    """Over open floor, then over floor where smoothing the corner leaves the cheap cells."""
    cells = np.zeros((SIDE, 2 * SIDE), np.uint8)
    cells[:, SIDE:] = 252
    cells[20, SIDE : SIDE + 21] = cells[5:21, SIDE + 20] = 0
    raw = resampled(
        np.array([[5.5, 5.5], [5.5, 20.5], [60.5, 20.5], [60.5, 5.5]]) * POSE_SPACING, POSE_SPACING
    )
    return CostGrid(cells, POSE_SPACING, (0, 0)), raw


def test_only_the_parts_of_a_path_that_cost_no_more_are_smoothed():
    costs, raw = path_with_two_bends()
    shaped = shape("constrained", costs, raw, 0.5, 1)
    path = smooth("constrained", PathCosts(costs, TRAVERSE), raw, 0.0).points[:, :2]
    price = partial(kernels.path_cost, costs.cells, TRAVERSE)
    assert price(shaped / POSE_SPACING) > price(raw / POSE_SPACING) >= price(path / POSE_SPACING)
    far = [min(np.hypot(*(path - POSE_SPACING * np.array(corner)).T)) for corner in BENDS]
    assert far[0] > 0.05 and far[1] < 0.02  # rounded over open floor, kept among dear cells


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), corners)
def test_a_mix_of_two_paths_costs_no_more_than_either(seed, cells_of_path):
    random = np.random.default_rng(seed)
    cells = random.integers(0, INSCRIBED_COST, (SIDE, SIDE)).astype(np.uint8)
    raw = resampled(np.array(cells_of_path, float) + 0.5, 1.0)
    other = raw.copy()
    other[1:-1] = np.clip(raw[1:-1] + random.normal(0.0, 0.7, (len(raw) - 2, 2)), 0.5, SIDE - 0.5)
    mix = kernels.blend(cells, TRAVERSE, raw, other, 0.0, 10.0)
    before = min(kernels.path_cost(cells, TRAVERSE, points) for points in (raw, other))
    assert kernels.path_cost(cells, TRAVERSE, mix) <= before * (1.0 + 1e-9)
    share = np.hypot(*(mix - raw).T) / np.maximum(np.hypot(*(other - raw).T), 1e-9)
    assert np.abs(np.diff(share[1:-1])).max(initial=0.0) <= 1.0 / kernels.BLEND_STEPS + 1e-6


LIMITS = [("astar", 1.01, 1.03), ("theta_star", 1.0, 1.02)]
"""Mean and largest cost over NavFn's."""


@pytest.mark.parametrize(("planner", "mean", "worst"), LIMITS)
def test_smoothed_paths_in_offices_cost_about_as_little_as_the_references(planner, mean, worst):
    row = measured(planner, {}, ROBOT, queries_for(ROBOT, 300, 18))
    assert row["found"] == "18/18"
    assert row["navfn_mean"] <= mean and row["navfn_worst"] <= worst


def test_the_reference_is_straight_over_open_floor():
    path = navfn_path(floor(), Pose2D(0.225, 0.225), Pose2D(1.725, 1.225))
    assert path is not None
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    assert length == pytest.approx(np.hypot(1.5, 1.0), rel=0.01)
    assert path_cost(floor(), path) == pytest.approx(length, rel=0.01)  # 1 per metre at cost 0


def test_the_reference_goes_round_a_wall():
    cells = np.zeros((SIDE, SIDE), np.uint8)
    cells[:30, 20] = 254  # up to y = 1.5
    path = navfn_path(floor(cells), Pose2D(0.525, 0.525), Pose2D(1.525, 0.525))
    assert path is not None
    # over the corner at (1.025, 1.525): 2 hypot(0.5, 1.0) = 2.24
    assert np.hypot(*np.diff(path, axis=0).T).sum() == pytest.approx(2.24, rel=0.04)
    column, row = np.floor(path / POSE_SPACING).astype(int).T
    assert cells[row, column].max() == 0


def test_the_cost_of_a_line_is_the_published_integral():
    costs = floor(np.full((SIDE, SIDE), 126, np.uint8))
    # 1 + 3 * 126 / 252 = 2.5 per metre
    assert path_cost(costs, np.array([[0.2, 0.2], [1.2, 0.2]])) == pytest.approx(2.5)


def test_there_is_no_reference_behind_a_closed_wall():
    cells = np.zeros((SIDE, SIDE), np.uint8)
    cells[:, 20] = 254
    assert navfn_path(floor(cells), Pose2D(0.525, 0.525), Pose2D(1.525, 0.525)) is None


def winding_poses(random, count=50):
    """(n, 3) poses 4 cm apart from (0.6, 1.0) whose curvature changes every ten poses."""
    turns = np.repeat(random.uniform(-0.05, 0.05, count // 10), 10)
    headings = np.cumsum(turns)
    steps = 0.04 * np.column_stack([np.cos(headings), np.sin(headings)])
    points = np.array([0.6, 1.0]) + np.cumsum(steps, axis=0)
    return np.column_stack([points, headings])


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(SMOOTHERS[:3]), st.integers(0, 2**32 - 1))
def test_a_smoothed_segment_of_poses_never_costs_more_than_it_did(smoother, seed):
    random = np.random.default_rng(seed)
    blocks = random.integers(0, INSCRIBED_COST, (10, 20)).astype(np.uint8)
    costs = CostGrid(np.kron(blocks, np.ones((5, 5), np.uint8)), POSE_SPACING, (-1.0, -0.25))
    checker = CollisionChecker.of(costs, Footprint.circle(0.1), TABLES)
    poses = winding_poses(random)
    drive = PoseDrive(poses, np.ones(len(poses), np.int64), 0.0)
    smooth = Shaping(smoother, 0.3, TRAVERSE).path(checker, drive).points
    if np.array_equal(smooth, poses):
        return
    origin = np.array(costs.origin)
    before, after = (
        kernels.path_cost(costs.cells, TRAVERSE, (points[:, :2] - origin) / POSE_SPACING)
        for points in (evenly(poses, 1), smooth)
    )
    assert after <= before
