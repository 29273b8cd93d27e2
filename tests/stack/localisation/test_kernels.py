"""Kernels and the surface field against closed forms."""

from math import cos, hypot, inf, nan, pi, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stack.localisation import kernels
from stack.localisation.distance_field import TRUNCATION, surface_field
from stack.localisation.particle_filter.particles import resampled
from stack.localisation.search.kernels import refine_pose
from stack.types import OccupancyGrid, Pose2D

RESOLUTION = 0.05


def room() -> OccupancyGrid:
    """A free square of 4 m, its low corner at (-2, -2), inside walls of 0.2 m."""
    cells = np.full((88, 88), 100, dtype=np.int8)
    cells[4:84, 4:84] = 0
    return OccupancyGrid(cells, RESOLUTION, (-2.2, -2.2))


def to_wall(x: float, y: float, angle: float) -> float:
    """Distance from a point in the square |x|, |y| < 2 to its side along a direction."""
    along = []
    for at, step in ((x, cos(angle)), (y, sin(angle))):
        if abs(step) > 1e-12:
            along.append(((2.0 if step > 0 else -2.0) - at) / step)
    return min(along)


@settings(deadline=None, max_examples=100)
@given(st.floats(-1.9, 1.9), st.floats(-1.9, 1.9), st.floats(-pi, pi))
def test_rays_end_on_the_square(x, y, angle):
    field = surface_field(room())
    sensor = np.array([x, y, 0.0])
    found = kernels.cast_rays(field.occupancy, field.placement, sensor, np.array([angle]), 12.0)
    assert found[0] == pytest.approx(to_wall(x, y, angle), abs=1e-6)


def test_a_ray_without_a_hit_within_its_limit_is_infinite():
    field = surface_field(room())
    angles = np.array([0.0])
    found = kernels.cast_rays(field.occupancy, field.placement, np.zeros(3), angles, 1.9)
    assert found[0] == inf


def test_distances_are_zero_on_surfaces_and_negative_inside():
    field = surface_field(room())
    row = field.distances[44]
    # cells 4 and 3 lie either side of the wall's face, half a cell away from it
    assert row[4] == pytest.approx(RESOLUTION / 2)
    assert row[3] == pytest.approx(-RESOLUTION / 2)
    # the middle is 2 m from every wall, beyond the truncation
    assert row[44] == TRUNCATION


def test_a_map_without_walls_has_no_surfaces():
    field = surface_field(OccupancyGrid(np.zeros((5, 6), dtype=np.int8), RESOLUTION))
    assert (field.distances == TRUNCATION).all()


def square_scan(x: float, y: float, heading: float) -> tuple[np.ndarray, np.ndarray]:
    angles = np.arange(36) * (2 * pi / 36) - pi
    return angles, np.array([to_wall(x, y, heading + a) for a in angles])


def judged(ranges: np.ndarray, angles: np.ndarray, sensor: tuple[float, float, float]):
    field = surface_field(room())
    return kernels.classify_beams(
        field.occupancy, field.distances, field.placement, np.array(sensor), angles, ranges, 12.0,
        0.08,
    )  # fmt: skip


def test_beams_are_classified():
    angles, ranges = square_scan(0.5, 0.3, 0.2)
    ranges[:6] = [0.5, inf, nan, ranges[3] + 1.0, ranges[4] + 0.05, ranges[5]]
    kinds, credits = judged(ranges, angles, (0.5, 0.3, 0.2))
    assert list(kinds[:4]) == [kernels.SHORT, kernels.MISSING, kernels.IGNORED, kernels.LONG]
    assert (kinds[4:] == kernels.MATCHED).all()
    # 5 cm along the beam is at most 5 cm from the surface: exp(-0.5 (5/8)²) = 0.82
    assert 0.8 < credits[4] < 1.0
    assert (credits[5:] > 0.99).all()


@pytest.mark.parametrize(
    ("limit", "kind"), [(2.3, kernels.IGNORED), (2.6, kernels.MISSING), (1.9, kernels.SILENT)]
)
def test_a_wall_in_the_last_half_metre_need_not_return_a_beam(limit, kind):
    """From the middle the wall stands 2.0 m away: within 0.5 m of 2.3 m, not of 2.6 m."""
    field = surface_field(room())
    kinds, _ = kernels.classify_beams(
        field.occupancy, field.distances, field.placement, np.zeros(3), np.zeros(1),
        np.array([inf]), limit, 0.08,
    )  # fmt: skip
    assert kinds[0] == kind


@pytest.mark.parametrize(
    ("height", "passes"), [(0.0, True), (0.93, True), (0.97, False), (1.03, False), (1.1, False)]
)
def test_a_beam_within_a_cell_of_the_edge_of_a_wall_does_not_pass_it(height, passes):
    """Of two equal rooms, the cells of one are up to a cell wider than those of the other."""
    grid = room()
    grid.cells[24:64, 63:65] = 100  # a wall from (0.95, -1.0) to (1.05, 1.0)
    field = surface_field(grid)
    kinds, _ = kernels.classify_beams(
        field.occupancy, field.distances, field.placement, np.array([0.65, height, 0.0]),
        np.zeros(1), np.array([1.15]), 12.0, 0.08,
    )  # fmt: skip
    assert (kinds[0] == kernels.LONG) == passes


@settings(deadline=None, max_examples=40)
@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.08, 0.08))
def test_alignment_finds_the_pose_a_scan_was_taken_at(dx, dy, turn):
    """Points exactly on the square; the map's faces are exact too: millimetres remain."""
    field, true = surface_field(room()), np.array([0.5, 0.3, 0.2])
    angles, ranges = square_scan(*true)
    points = np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
    found = refine_pose(
        field.distances,
        field.placement,
        true + np.array([dx, dy, turn]),
        np.zeros((3, 3)),
        points,
        0.1,
    )
    assert hypot(*(found[:2] - true[:2])) < 0.01
    assert abs(found[2] - true[2]) < 0.01


def test_a_system_of_three_equations_is_solved():
    """H = L L' with L = [[2, 0, 0], [1, 3, 0], [-1, 2, 1]], and g = H (1, -2, 3), by hand."""
    h = np.array([[4.0, 2.0, -2.0], [nan, 10.0, 5.0], [nan, nan, 6.0]])  # the upper triangle counts
    solution = kernels.solve(h, np.array([-6.0, -3.0, 6.0]), 1e-9, 0.0)
    assert solution == pytest.approx([1.0, -2.0, 3.0], abs=1e-6)


def test_a_wall_at_45_degrees_draws_the_pose_along_its_normal():
    """Minimise (n p - d)² + λ |p - p0|²: p = p0 - n (n p0 - d) / (1 + λ), here λ = 0.5.

    The wall is x + y = 4, so p0 = (1.8, 1.5) lies 0.7 / sqrt(2) m before it and moves by
    0.7 / (2 · 1.5) m along both axes. A point at the base says nothing of the heading.
    """
    row, column = np.mgrid[:80, :80]
    distances = (((row + column + 1) * RESOLUTION - 4.0) / 2**0.5).astype(np.float32)
    found = refine_pose(
        distances, (RESOLUTION, 0.0, 0.0), np.array([1.8, 1.5, 0.7]), 0.5 * np.eye(3),
        np.zeros((1, 2)), 1e6,
    )  # fmt: skip
    assert found == pytest.approx([1.8 + 0.7 / 3.0, 1.5 + 0.7 / 3.0, 0.7], abs=1e-4)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30), st.floats(0.0, 0.999))
def test_low_variance_resampling_is_off_by_less_than_one(raw, offset):
    """Each particle is drawn n·w times, rounded down or up (Probabilistic Robotics, 4.3.4)."""
    weights = np.array(raw) + 1e-3
    weights /= weights.sum()
    counts = np.bincount(resampled(weights, 100, offset), minlength=weights.size)
    assert counts.sum() == 100
    assert (np.abs(counts - 100 * weights) < 1.0 + 1e-9).all()


@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-4, 4)), min_size=1),
    st.lists(st.tuples(st.floats(-6, 6), st.floats(-6, 6)), max_size=20),
)
def test_scores_are_sums_of_the_table_at_the_cells_of_the_points(poses, points):
    """Except for points within a rounding error of a cell's edge."""
    table = np.arange(88 * 88, dtype=np.int16).reshape(88, 88)
    padded = np.pad(table, 1, constant_values=-7)
    at, ends = np.array(poses), np.array(points).reshape(-1, 2)
    found, blocked = kernels.score_poses(
        padded,
        np.zeros((88, 88), np.uint8),
        (RESOLUTION, -2.2, -2.2),
        at,
        np.ascontiguousarray(ends.T, dtype=np.float32),
    )
    for (x, y, heading), score in zip(poses, found, strict=True):
        c, s = cos(heading), sin(heading)
        u = (x + c * ends[:, 0] - s * ends[:, 1] + 2.2) / RESOLUTION
        v = (y + s * ends[:, 0] + c * ends[:, 1] + 2.2) / RESOLUTION
        assume((np.abs(u - np.rint(u)) > 1e-3).all() and (np.abs(v - np.rint(v)) > 1e-3).all())
        inside = (u >= 0) & (v >= 0) & (u < 88) & (v < 88)
        cells = table[np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)]
        assert score == np.where(inside, cells.astype(int), -7).sum()
    cells = [((x + 2.2) / RESOLUTION, (y + 2.2) / RESOLUTION) for x, y, _ in poses]
    assert list(blocked) == [not (0 <= u < 88 and 0 <= v < 88) for u, v in cells]


def test_scores_of_many_poses_are_those_of_each_alone():
    """The kernel works in blocks; the last one is not full, and one pose may be outside."""
    generator = np.random.default_rng(3)
    table = generator.integers(-9000, 0, (90, 90)).astype(np.int16)
    occupancy = generator.integers(0, 3, (88, 88)).astype(np.uint8)
    poses = generator.uniform(-2.5, 2.5, (2 * kernels.BLOCK + 3, 3))
    points = generator.uniform(-3.0, 3.0, (2, 13)).astype(np.float32)

    def score(some):
        return kernels.score_poses(table, occupancy, (RESOLUTION, -2.2, -2.2), some, points)

    scores, blocked = score(poses)
    alone = [score(pose[None]) for pose in poses]
    assert [one[0][0] for one in alone] == list(scores)
    assert [one[1][0] for one in alone] == list(blocked)


def test_rays_leave_the_object_that_they_begin_in():
    """A mapped object at the lidar's own place is not there: the wall behind it counts."""
    grid = room()
    grid.cells[40:48, 40:48] = 100  # |x|, |y| < 0.2
    field = surface_field(grid)
    found = kernels.cast_rays(field.occupancy, field.placement, np.zeros(3), np.array([0.0]), 12.0)
    assert found[0] == pytest.approx(2.0)


def test_poses_in_walls_and_outside_the_map_are_known():
    field = surface_field(room())
    poses = np.array([[0.0, 0.0, 0.0], [-2.15, 0.0, 0.0], [-9.0, 0.0, 0.0]])
    assert [field.is_blocked(Pose2D(*pose)) for pose in poses] == [False, True, True]
    _, blocked = kernels.score_poses(
        np.zeros((90, 90), np.int16), field.occupancy, field.placement, poses,
        np.zeros((2, 1), np.float32),
    )  # fmt: skip
    assert list(blocked) == [False, True, True]
