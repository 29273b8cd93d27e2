"""A jump shows in map -> odom; an estimator of a plugin says nothing else about it."""

from dataclasses import replace

import numpy as np
import pytest

from stack.components import Estimator
from stack.frames.buffer import TransformBuffer
from stack.localisation.parameters import DeadReckoningParameters
from stack.types import (
    STANDSTILL,
    Observation,
    Odometry,
    Perceived,
    Pose2D,
    PoseEstimate,
    TrackedObject,
    WorldView,
    has_jumped,
)
from tests.stack.navigation.toy_world import robot

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


class Teleported(Estimator):
    """A plugin's estimator: it is 5 m off from the second second on, and states only its pose."""

    Parameters = DeadReckoningParameters

    def start(self, pose):
        return

    def set_pose(self, pose, position_deviation, heading_deviation):
        return

    def update(self, observation, frames):
        self.estimate = estimate(Pose2D(5.0 * (observation.time >= 2.0), 0.0))
        return replace(self.estimate, corrected_at=observation.time)

    estimate = None


def test_a_plugins_jump_is_not_smeared_over_the_time_before_it():
    frames, estimator = TransformBuffer(), Teleported(DeadReckoningParameters(), robot(), None, 0)
    for time in (0.0, 1.0, 2.0):
        frames.add(Odometry(time, DRIVEN, STANDSTILL))
        frames.correct(estimator.update(Observation(time, {}), frames))
    assert frames.map_from_odom(1.9).x == 0.0 and frames.map_from_odom(2.0).x == 5.0


def test_what_was_seen_before_a_jump_is_forgotten():
    seen = Perceived(0.0, estimate(Pose2D(0.0, 0.0)), world=WorldView(tracks=(TRACK,)))
    assert seen.at(estimate(Pose2D(0.1, 0.0))).world.tracks
    assert not seen.at(estimate(Pose2D(5.0, 0.0))).world.tracks
