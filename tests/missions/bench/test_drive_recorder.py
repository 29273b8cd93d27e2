"""What the recorder makes of steps and events, by hand."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt

import numpy as np
import pytest

from missions.bench.drive_recorder import DriveRecorder
from stack.telemetry.records import Event, MissionState, Snapshot
from stack.types import Battery, Pose2D, Twist

GOAL = Pose2D(3.0, 0.0)


def step(number, twist=Twist(), goal=None, truth=Pose2D(0.0, 0.0)):
    return Snapshot(
        0.1 * number, number, MissionState.RUNNING, "", (), truth, np.zeros((3, 3)), 1.0,
        Battery(1.0, 24.0), commanded=twist, goal=goal, truth=truth,
    )  # fmt: skip


def happened(kind, **fields):
    return Event(0, 0, 0.0, "info", "navigation", kind, kind, fields)


def ended(status, *, moves=True):
    return happened("task", status=status, moves=moves)


def test_turning_and_jerk_of_a_made_up_drive():
    recorder = DriveRecorder()
    twists = [(0.0, 0.0), (0.1, 0.2), (0.2, -0.2), (0.2, 0.0)]
    for number, (linear, angular) in enumerate(twists, start=1):
        recorder.snapshot(step(number, Twist(linear, angular)))
    # three steps of 0.1 s in motion; angular changes 0.2, 0.4, 0.2
    assert recorder.turning == pytest.approx(0.8 / 0.3)
    # second changes of the speed 0.1, 0.0, -0.1 m/s in 0.1 s each: 10, 0, -10 m/s³
    assert recorder.jerk == pytest.approx(sqrt(200.0 / 3.0))


def test_standing_counts_for_nothing_and_the_last_step_counts_once():
    recorder = DriveRecorder()
    for number in range(1, 5):
        recorder.snapshot(step(number))
    assert (recorder.turning, recorder.jerk) == (0.0, 0.0)
    recorder.snapshot(step(5, Twist(0.0, 0.3)))
    once = recorder.turning
    recorder.snapshot(step(5, Twist(0.0, 0.3)))
    assert recorder.turning == once == pytest.approx(3.0)


def test_a_snapshot_from_the_middle_of_a_step_changes_no_figure():
    """While a step waits for a plan, clients are served with the command of the step before."""
    quiet, busy = DriveRecorder(), DriveRecorder()
    speeds = (0.0, 0.1, 0.2, 0.2)
    for number, (before, now) in enumerate(pairwise((0.0, *speeds)), start=1):
        busy.snapshot(step(number, Twist(before)))
        for recorder in (quiet, busy):
            recorder.snapshot(step(number, Twist(now, 0.5 * now)))
    assert quiet.jerk > 0.0 and quiet.turning > 0.0
    assert (busy.jerk, busy.turning) == (quiet.jerk, quiet.turning)


def test_a_goal_is_met_where_the_robot_truly_is():
    recorder = DriveRecorder()
    recorder.event(happened("goal"))
    recorder.snapshot(step(1, goal=GOAL))
    recorder.event(ended("succeeded"))
    recorder.snapshot(step(2, truth=Pose2D(3.0, 0.1)))
    assert recorder.reached == [(GOAL, Pose2D(3.0, 0.1))]


def test_a_plan_that_succeeds_during_a_drive_meets_no_goal():
    recorder = DriveRecorder()
    recorder.event(happened("goal"))
    recorder.snapshot(step(1, goal=GOAL))
    recorder.event(ended("succeeded", moves=False))
    recorder.snapshot(step(2, goal=GOAL, truth=Pose2D(1.0, 0.0)))
    recorder.event(ended("succeeded"))
    recorder.snapshot(step(3, truth=Pose2D(3.0, 0.1)))
    assert recorder.reached == [(GOAL, Pose2D(3.0, 0.1))]


@pytest.mark.parametrize("status", ["failed", "cancelled"])
def test_a_drive_that_does_not_succeed_meets_no_goal(status):
    recorder = DriveRecorder()
    recorder.event(happened("goal"))
    recorder.snapshot(step(1, goal=GOAL))
    recorder.event(ended(status))
    recorder.snapshot(step(2))
    assert recorder.reached == []


def test_a_recovery_that_succeeds_meets_no_goal():
    recorder = DriveRecorder()
    recorder.snapshot(step(1, goal=GOAL))
    recorder.event(happened("recovery"))
    recorder.event(ended("succeeded"))
    recorder.snapshot(step(2))
    assert recorder.reached == []


def test_the_views_of_a_recovery_are_no_goals():
    recorder = DriveRecorder()
    recorder.event(happened("recovery"))
    recorder.snapshot(step(1, goal=GOAL))
    recorder.event(ended("succeeded"))
    recorder.snapshot(step(2))
    assert recorder.reached == []
