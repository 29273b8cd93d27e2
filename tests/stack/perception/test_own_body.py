"""Beams that see the robot itself are invalid, and nothing else is."""

from dataclasses import replace
from itertools import pairwise
from math import pi, radians

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stack.perception.obstacle_memory import blind_sectors
from stack.perception.own_body import INSIDE, OwnBody
from stack.types import Footprint, Observation, Pose2D, Scan
from tests.stack.sim.sim_rover import LIDAR, ROVER

BOX = Footprint(np.array([[-0.3, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.3, 0.2]]))


def removed(robot, ranges, mount=Pose2D(0.0, 0.0)):
    count = len(ranges)
    scan = Scan(0.0, np.array(ranges, np.float32), -pi, 2 * pi / count, 0.05, 9.0, mount)
    observation = Observation(0.0, {"lidar": scan})
    after = OwnBody(robot).removed(observation)
    return scan, after.measurements["lidar"], after is observation


@given(
    ranges=st.lists(st.floats(0.05, 0.8), min_size=4, max_size=60),
    x=st.floats(-0.4, 0.4), y=st.floats(-0.3, 0.3), heading=st.floats(-pi, pi),
)  # fmt: skip
def test_what_ends_inside_the_footprint_is_the_robot(ranges, x, y, heading):
    scan, after, is_same = removed(
        replace(ROVER, footprint=BOX, lidar=LIDAR), ranges, Pose2D(x, y, heading)
    )
    ends = np.abs(scan.points())
    depth = np.minimum(0.3 - ends[:, 0], 0.2 - ends[:, 1])  # inside the box of 0.6 m by 0.4 m
    sure = np.abs(depth - INSIDE) > 1e-6
    assert (np.isnan(after.ranges) == (depth > INSIDE))[sure].all()
    kept = np.isfinite(after.ranges)
    assert (after.ranges[kept] == scan.ranges[kept]).all()
    assert is_same == kept.all()


@given(first=st.floats(-pi, pi), width=st.floats(0.01, pi))
def test_masked_directions_are_invalid_also_across_the_end_of_the_turn(first, width):
    last = (first + width + pi) % (2 * pi) - pi
    lidar = replace(LIDAR, mask=((first, last),))
    scan, after, _ = removed(replace(ROVER, lidar=lidar), np.full(90, 3.0))
    within = (scan.angles - first) % (2 * pi)
    sure = (np.abs(within - width) > 1e-6) & (np.minimum(within, 2 * pi - within) > 1e-6)
    assert (np.isnan(after.ranges) == (within < width))[sure].all()


def test_a_narrow_mask_leaves_no_blind_sector_and_a_wide_one_does():
    def blind(degrees):
        mask = ((radians(-0.5 * degrees), radians(0.5 * degrees)),)
        all_round = replace(LIDAR, mount=Pose2D(0.0, 0.0), mask=mask)
        return blind_sectors(replace(ROVER, lidar=all_round))

    assert len(blind(10.0)) == 0
    ((_, width),) = blind(90.0)
    assert abs(width - pi / 2) < 0.02


def cut(first, width, at):
    """A mask in pieces, each beginning where another ends; (from, to) in -pi to pi."""
    ends = [first, *(first + share * width for share in sorted(at)), first + width]
    return [tuple((end + pi) % (2 * pi) - pi for end in pair) for pair in pairwise(ends)]


@given(
    first=st.floats(-pi, pi), width=st.floats(0.4, 4.0),
    at=st.lists(st.floats(0.1, 0.9), max_size=4), order=st.randoms(),
)  # fmt: skip
def test_masks_that_touch_are_as_wide_as_they_are_together(first, width, at, order):
    pieces = cut(first, width, at)
    order.shuffle(pieces)
    lidar = replace(LIDAR, mask=tuple(pieces))
    middle = np.array([first + 0.5 * width])
    assert lidar.masks(middle, width - 1e-3).all()
    assert not lidar.masks(middle, width + 1e-3).any()


def test_narrow_masks_apart_from_each_other_stay_narrow():
    mask = tuple((radians(start), radians(start + 10.0)) for start in (0.0, 10.5, -10.5))
    assert not replace(LIDAR, mask=mask).masks(np.radians([5.0, 15.0, -5.0]), radians(20.0)).any()
