"""Parts of clusters and circles through arcs, with exact and with noisy rays."""

from math import asin, hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.perception.tracking.arcs import convex_parts, fit_arc

INCREMENT = 2.0 * pi / 720


def returns(circles, noise=0.0, random=None):
    """(n, 2) returns of circles (x, y, radius), sensor at the origin, in the order of the beams."""
    angles = np.arange(-pi, pi, INCREMENT)
    ranges = np.full(len(angles), np.inf)
    for x, y, radius in circles:
        along, across = (
            x * np.cos(angles) + y * np.sin(angles),
            y * np.cos(angles) - x * np.sin(angles),
        )
        hit = (np.abs(across) < radius) & (along > 0.0)
        chord = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
        ranges = np.where(hit, np.minimum(ranges, along - chord), ranges)
    seen = np.isfinite(ranges)
    ranges = ranges[seen] + (random.normal(0.0, noise, seen.sum()) if noise else 0.0)
    return np.column_stack((np.cos(angles[seen]), np.sin(angles[seen]))) * ranges[:, None]


@given(st.floats(0.15, 0.6), st.floats(1.5, 8.0), st.integers(0, 99))
@settings(deadline=None, max_examples=60)
def test_one_body_is_one_part(radius, distance, seed):
    points = returns([(distance, 0.0, radius)], 0.01, np.random.default_rng(seed))
    assert convex_parts(points) == [(0, len(points))]


@given(st.floats(0.2, 0.6), st.floats(0.2, 0.6), st.floats(2.0, 6.0))
@settings(deadline=None, max_examples=60)
def test_two_bodies_side_by_side_are_two_parts(first, second, distance):
    """The corner between them lies on the line of sight past their point of contact."""
    points = returns([(distance, 0.0, first), (distance, first + second, second)])
    (_, corner), (begin, end) = convex_parts(points)
    assert corner == begin
    assert end == len(points)
    expected = np.searchsorted(np.arctan2(points[:, 1], points[:, 0]), asin(first / distance))
    assert abs(corner - expected) <= 2


def test_a_room_around_the_sensor_is_one_part():
    angles = np.arange(-pi, pi, INCREMENT)
    away = 3.0 / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    points = np.column_stack((np.cos(angles), np.sin(angles))) * away[:, None]
    assert convex_parts(points) == [(0, len(points))]


@pytest.mark.parametrize("share", [0.4, 0.5, 0.75, 1.0])
def test_the_circle_is_within_three_deviations_of_the_true_one(share):
    """The least share of the visible side that determines it at 3 m with 1 cm of noise is 0.4."""
    random = np.random.default_rng(7)
    near = []
    for _ in range(200):
        points = returns([(3.0, 0.0, 0.5)], 0.01, random)
        arc = fit_arc(points[: round(share * len(points))])
        if arc is not None:
            near.append(hypot(arc.centre[0] - 3.0, arc.centre[1]) <= 3.0 * arc.deviation)
    assert len(near) > 120
    assert np.mean(near) > 0.97


def test_a_wall_is_no_circle():
    y = np.linspace(-0.5, 0.5, 40)
    wall = np.column_stack((np.full(40, 2.0), y))
    assert fit_arc(wall) is None
    assert fit_arc(wall + np.random.default_rng(1).normal(0.0, 0.01, wall.shape)) is None


def test_a_hollow_is_no_circle():
    angles = np.linspace(-0.6, 0.6, 40)
    assert fit_arc(np.column_stack((2.0 + 0.5 * np.cos(angles), 0.5 * np.sin(angles)))) is None


def test_few_returns_determine_no_circle():
    assert fit_arc(returns([(3.0, 0.0, 0.5)])[:7]) is None
