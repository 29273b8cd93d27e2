"""Smoothed ranges: walls keep their place, noise shrinks, corners stay where the lidar saw them."""

from __future__ import annotations

from math import inf, nan, radians, sqrt

import numpy as np
import pytest

from stack.perception.smoothing import SAME_SURFACE, SPAN, smooth_observation, smoothed
from stack.safety.parameters import SafetyParameters
from stack.types import Imu, Observation, Scan

STEP = radians(0.375)
"""Between the beams of the jackal's lidar: 270 degrees, 720 beams."""

NOISE = 0.01
"""Standard deviation of its ranges, metres."""


def scan(ranges) -> Scan:
    """A scan with its beams around the x axis."""
    ranges = np.asarray(ranges, dtype=np.float32)
    return Scan(0.0, ranges, -0.5 * STEP * (ranges.size - 1), STEP, 0.1, 30.0)


def wall(distance, noise=0.0, seed=0, tilt=0.0, beams=321):
    """A flat wall ahead; `tilt` radians from square to the x axis."""
    angles = STEP * (np.arange(beams) - beams // 2)
    ranges = distance * np.cos(tilt) / np.cos(angles - tilt)
    return scan(ranges + np.random.default_rng(seed).normal(0.0, noise, beams))


def wedge(distance, angle, step=STEP):
    """A convex edge ahead that points at the lidar, with an angle between its faces."""
    half, off = angle / 2.0, np.abs(step * np.arange(-60, 61))
    seen = off < half
    ranges = np.full(off.size, inf)
    ranges[seen] = distance * np.sin(half) / np.sin(half - off[seen])
    ranges[ranges > 5.0] = inf
    return Scan(0.0, ranges.astype(np.float32), -60 * step, step, 0.1, 30.0)


@pytest.mark.parametrize("tilt", [0.0, 1.0])
@pytest.mark.parametrize("distance", [0.3, 1.0, 4.0])
def test_a_flat_wall_stays_where_it_is(distance, tilt):
    points = smoothed(wall(distance, tilt=tilt, beams=161)).points()
    off = points @ (np.cos(tilt), np.sin(tilt)) - distance * np.cos(tilt)
    assert np.abs(off).max() < 0.001  # a wall is bent by (1.5 cm)² / 2 / 0.3 m = 0.4 mm


def test_noise_shrinks_with_the_square_root_of_the_beams_that_are_averaged():
    """At 0.5 m beams are 3.3 mm apart: four pairs within 1.5 cm and the beam itself."""
    errors = [smoothed(wall(0.5, NOISE, seed)).points()[150:171, 0] - 0.5 for seed in range(60)]
    assert np.std(errors) == pytest.approx(NOISE / sqrt(9), rel=0.15)


def test_no_beam_of_a_near_wall_is_left_far_before_it():
    """Of 320 beams the worst is 3 sigma (3 cm) off; a crawl keeps half of that free."""
    nearest = [0.25 - smoothed(wall(0.25, NOISE, seed)).points()[:, 0].min() for seed in range(20)]
    assert np.median(nearest) < 0.01
    assert np.median([0.25 - wall(0.25, NOISE, s).points()[:, 0].min() for s in range(20)]) > 0.02


@pytest.mark.parametrize("degrees", [20, 30, 45, 60, 90, 120])
@pytest.mark.parametrize("distance", [0.3, 0.5, 1.0])
def test_a_corner_is_seen_little_deeper_than_it_is(distance, degrees):
    raw, smooth = wedge(distance, radians(degrees)), smoothed(wedge(distance, radians(degrees)))
    deeper = np.linalg.norm(smooth.points() - (distance, 0.0), axis=1).min()
    assert deeper <= (SPAN / 2 + 0.001 if degrees >= 90 else 2 / 3 * SAME_SURFACE)
    assert SPAN <= SafetyParameters().tight_padding
    assert np.isinf(smooth.ranges).tolist() == np.isinf(raw.ranges).tolist()


def test_what_one_beam_sees_stays_where_it_is():
    ranges = wall(2.0).ranges.copy()
    ranges[160] *= 0.5
    assert smoothed(scan(ranges)).ranges[160] == ranges[160]


def test_beams_without_return_and_invalid_ones_stay_and_move_no_other():
    ranges = wall(0.4).ranges.copy()
    ranges[50], ranges[52] = inf, nan
    smooth = smoothed(scan(ranges)).ranges
    assert smooth[50] == inf and np.isnan(smooth[52])
    assert smooth[40:50] == pytest.approx(ranges[40:50], abs=0.002)


@pytest.mark.parametrize("beams", [0, 1, 2, 3])
def test_scans_of_few_beams(beams):
    assert smoothed(scan([1.0] * beams)).ranges.tolist() == [1.0] * beams


def test_only_scans_are_smoothed():
    imu = Imu(1.0, 0.1, 0.0)
    both = smooth_observation(Observation(1.0, {"imu": imu, "lidar": wall(0.4, NOISE)}))
    assert both.measurements["imu"] is imu
    assert both.measurements["lidar"].ranges.tolist() != wall(0.4, NOISE).ranges.tolist()
    alone = Observation(1.0, {"imu": imu})
    assert smooth_observation(alone) is alone
