"""A jump shows in map -> odom, whether or not the estimator counts it."""

import numpy as np
import pytest

from stack.types import Perceived, Pose2D, PoseEstimate, TrackedObject, WorldView, has_jumped

DRIVEN = Pose2D(40.0, 3.0, 0.2)
"""Odometry: far from its origin, where a small turn of the map is metres."""


TRACK = TrackedObject(1, 0.0, (1.0, 0.0), (1.0, 0.0), 0.3, np.eye(4))


def estimate(map_from_odom: Pose2D, odometry: Pose2D = DRIVEN) -> PoseEstimate:
    return PoseEstimate(map_from_odom.compose(odometry), np.eye(3), 1.0, map_from_odom)


@pytest.mark.parametrize(
    ("after", "jumped"),
    [
        (Pose2D(1.0, 0.0, 0.0), False),  # no change
        (Pose2D(1.2, 0.0, 0.0), False),  # 0.2 m of 0.3 m
        (Pose2D(1.4, 0.0, 0.0), True),
        (Pose2D(1.0, 0.0, 0.02), True),  # 0.02 rad at 40 m: 0.8 m
    ],
)
def test_the_change_of_the_map_at_the_robot_counts(after, jumped):
    assert has_jumped(estimate(Pose2D(1.0, 0.0)), estimate(after)) is jumped


def test_motion_of_the_robot_is_no_jump():
    ahead = DRIVEN.compose(Pose2D(2.0, 0.0, 1.0))
    assert not has_jumped(estimate(Pose2D(1.0, 0.0)), estimate(Pose2D(1.0, 0.0), ahead))


def test_what_was_seen_before_a_jump_that_no_estimator_counted_is_forgotten():
    seen = Perceived(0.0, estimate(Pose2D(0.0, 0.0)), world=WorldView(tracks=(TRACK,)))
    assert seen.at(estimate(Pose2D(0.1, 0.0))).world.tracks
    assert not seen.at(estimate(Pose2D(5.0, 0.0))).world.tracks
